// Sources to the two things that are published: `web/dist` (the npm package) and `www/dist` (the static site, which uses that package).
// `--quick` leaves wasm-opt out, for a short way from a change to the page.
import { createHash } from 'node:crypto';
import { cpSync, existsSync, mkdirSync, readFileSync, readdirSync, rmSync, writeFileSync } from 'node:fs';
import { join } from 'node:path';
import { buildEnv, wasmEnv } from './env.mjs';
import { Missing, isMain, must, root, run, seconds } from './run.mjs';
import { optimise } from './wasm-opt.mjs';

const at = (...parts) => join(root, ...parts);
const engine = ['engine.js', 'engine.d.ts', 'engine_bg.wasm', 'engine_bg.wasm.d.ts'];
const sources = ['weights/ipdrecon.safetensors', 'worker/src/lib.rs', 'worker/src/worker.ts', 'web/src', 'web/tsconfig.json', 'web/tsconfig.worker.json', 'www/src', 'www/tsconfig.json', 'www/index.html'];
const notServed = new Set(['src', 'dist', 'node_modules', 'tsconfig.json', 'package.json', 'README.md']);

function fresh(folder) {
  rmSync(folder, { recursive: true, force: true });
  mkdirSync(folder, { recursive: true });
}

async function wasm() {
  const words = ['build', 'worker', '--target', 'web', '--profile', 'web', '--out-dir', 'pkg', '--out-name', 'engine', '--mode', 'no-install', '--no-pack', '--no-opt'];
  await must('wasm-pack', words, { env: { ...wasmEnv(), CARGO_TARGET_DIR: process.env.CARGO_TARGET_DIR ?? at('target') } });
}

async function tsc(project) {
  const result = await run(process.execPath, [at('node_modules/typescript/bin/tsc'), '-p', project], { env: buildEnv() });
  if (result.code !== 0) throw Object.assign(new Error(`tsc -p ${project} found errors`), { output: result.output });
}

/** The released weights, and a module that says where they lie, what they must hash to and how large they are. */
function weights() {
  const name = 'ipdrecon.safetensors';
  cpSync(at('weights', name), at('web/dist', name));
  const file = readFileSync(at('weights', name));
  const sha256 = createHash('sha256').update(file).digest('hex');
  writeFileSync(at('web/dist/released.js'), `export const released = ${JSON.stringify({ url: `./${name}`, sha256, bytes: file.length })};\n`);
  writeFileSync(at('web/dist/released.d.ts'), 'export declare const released: { url: string; sha256: string; bytes: number };\n');
}

async function assemble(quick) {
  fresh(at('web/dist'));
  weights();
  for (const name of engine) cpSync(at('worker/pkg', name), at('web/dist', name));
  if (!quick) await optimise(at('web/dist/engine_bg.wasm'));
  await tsc('web/tsconfig.worker.json');
  await tsc('web/tsconfig.json');
}

async function site() {
  fresh(at('www/dist'));
  cpSync(at('web/dist'), at('www/dist/ipdrecon'), { recursive: true });
  await tsc('www/tsconfig.json');
  for (const name of readdirSync(at('www'))) {
    if (!notServed.has(name) && !name.startsWith('.')) cpSync(at('www', name), at('www/dist', name), { recursive: true });
  }
}

/** Builds everything, a line for each step; throws what went wrong. */
export async function build({ quick = false } = {}) {
  const missing = sources.filter((path) => !existsSync(at(path)));
  if (missing.length > 0) throw new Missing(`bring back the sources that are missing: ${missing.join(', ')}`);
  /** @type {[string, () => Promise<void>][]} */
  const steps = [
    ['engine: Rust to wasm', wasm],
    [`web/dist: ${quick ? '' : 'wasm-opt, '}worker and client`, () => assemble(quick)],
    ['www/dist: the site', site],
  ];
  for (const [name, make] of steps) {
    const start = performance.now();
    await make();
    console.log(`build   ${name} (${seconds(start)})`);
  }
}

if (isMain(import.meta.url)) {
  const { npmPackages } = await import('./setup/npm.mjs');
  try {
    await npmPackages((what) => console.log(`set-up  ${what}`));
    await build({ quick: process.argv.includes('--quick') });
  } catch (error) {
    if (error.output) console.error(error.output.trimEnd());
    console.error(`build   failed: ${error.message}`);
    process.exit(1);
  }
}
