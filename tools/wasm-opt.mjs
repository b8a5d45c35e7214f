// wasm-opt from the npm package binaryen, asked only once for each input: its result is kept under the hash of what went in.
import { createHash } from 'node:crypto';
import { copyFileSync, existsSync, mkdirSync, readFileSync, readdirSync, rmSync } from 'node:fs';
import { basename, join } from 'node:path';
import { must, root, toolsDir } from './run.mjs';

const cache = join(toolsDir, 'wasm-opt');
/** The WebAssembly features that rustc's wasm32 and `+simd128` use, and no more: every browser with WebGPU has them. */
const features = ['simd', 'bulk-memory', 'bulk-memory-opt', 'sign-ext', 'nontrapping-float-to-int', 'mutable-globals', 'reference-types', 'multivalue', 'call-indirect-overlong'];
const words = ['-Oz', ...features.map((name) => `--enable-${name}`), '--strip-debug', '--strip-producers', '--strip-target-features'];

/** Replaces a wasm file by its optimised form. */
export async function optimise(path) {
  const version = JSON.parse(readFileSync(join(root, 'node_modules/binaryen/package.json'), 'utf8')).version;
  const hash = createHash('sha256').update(readFileSync(path)).update([version, ...words].join(' ')).digest('hex');
  const name = basename(path, '.wasm');
  const kept = join(cache, `${name}-${hash}.wasm`);
  if (!existsSync(kept)) {
    mkdirSync(cache, { recursive: true });
    for (const old of readdirSync(cache)) if (old.startsWith(`${name}-`)) rmSync(join(cache, old));
    await must(process.execPath, [join(root, 'node_modules/binaryen/bin/wasm-opt'), path, ...words, '-o', `${kept}.part.wasm`]);
    copyFileSync(`${kept}.part.wasm`, kept);
    rmSync(`${kept}.part.wasm`);
  }
  copyFileSync(kept, path);
}
