// wasm-bindgen's command and wasm-pack, each in the one version that fits the lock file, below .tools.
import { readFileSync, rmSync } from 'node:fs';
import { join } from 'node:path';
import { Missing, must, root, run, toolsDir, which } from '../run.mjs';
import { buildEnv } from '../env.mjs';

/** Both share what they build; the process id keeps two set-ups at once apart. */
const buildDir = join(toolsDir, `build-${process.pid}`);

export const wasmPackVersion = '0.15.1';

/** The command must have the version of the crate, or it refuses what the crate built. */
export function wasmBindgenVersion() {
  const lock = readFileSync(join(root, 'Cargo.lock'), 'utf8');
  return /name = "wasm-bindgen"\nversion = "([^"]+)"/.exec(lock)?.[1] ?? '0.2.130';
}

async function hasVersion(program, version) {
  const said = await run(program, ['--version'], { env: buildEnv() });
  return said.code === 0 && said.output.split(/\s+/).includes(version);
}

async function cargoInstall(say, name, version, words, settings) {
  if (!which('cargo')) throw new Missing('install Rust from https://rustup.rs');
  say(`cargo install ${name}@${version}`);
  const env = { ...process.env, ...settings, CARGO_TARGET_DIR: buildDir };
  await must('cargo', ['install', `${name}@${version}`, '--root', toolsDir, ...words], { env, limitSeconds: 1800 });
}

export async function cargoTools(say) {
  const bindgen = wasmBindgenVersion();
  if (!(await hasVersion('wasm-bindgen', bindgen)) || !(await hasVersion('wasm-bindgen-test-runner', bindgen))) {
    await cargoInstall(say, 'wasm-bindgen-cli', bindgen, [], {});
  }
  if (!(await hasVersion('wasm-pack', wasmPackVersion))) {
    await cargoInstall(say, 'wasm-pack', wasmPackVersion, ['--locked'], {});
  }
  rmSync(buildDir, { recursive: true, force: true });
}
