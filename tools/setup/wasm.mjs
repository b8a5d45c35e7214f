// The wasm32 target: rustup's where it can be downloaded, Debian's own packages where not. Shown to work by linking, not by a folder's presence.
import { existsSync, mkdtempSync, rmSync } from 'node:fs';
import { tmpdir } from 'node:os';
import { join } from 'node:path';
import { Missing, must, run, which } from '../run.mjs';
import { candidate, mayInstall } from './apt.mjs';
import { installDebianTarget } from './debian.mjs';
import { prove, proven } from './state.mjs';

export const target = 'wasm32-unknown-unknown';
const library = '#[unsafe(no_mangle)] pub extern "C" fn probe(n: usize) -> usize { vec![n; n].len() }';
const test = '#[test] fn probe() { assert_eq!(vec![1; 3].len(), 3) }';

const toolchainEnv = (toolchain) => (toolchain ? { ...process.env, RUSTUP_TOOLCHAIN: toolchain } : process.env);

/** The key under which a toolchain was shown to build for wasm: its version, and that its library is still there. */
async function toolchainKey(toolchain) {
  const env = toolchainEnv(toolchain);
  const version = await run('rustc', ['-vV'], { env });
  if (version.code !== 0) return null;
  const folder = await run('rustc', ['--print', 'target-libdir', '--target', target], { env });
  return existsSync(folder.output.trim()) ? version.output : null;
}

/** Compiles and links an empty library and an empty test for wasm, or throws what the compiler said. */
async function link(toolchain) {
  const folder = mkdtempSync(join(tmpdir(), 'wasm-probe-'));
  try {
    const common = ['--edition', '2024', '--target', target, '-'];
    const compile = (source, ...kind) => must('rustc', [...kind, ...common], { env: toolchainEnv(toolchain), input: source, cwd: folder });
    await compile(library, '--crate-type', 'cdylib', '-o', 'lib.wasm');
    await compile(test, '--test', '-o', 'test.wasm');
  } finally {
    rmSync(folder, { recursive: true, force: true });
  }
}

async function works(toolchain) {
  const key = await toolchainKey(toolchain);
  if (key === null) return false;
  try {
    await link(toolchain);
  } catch {
    return false;
  }
  prove('wasm', { toolchain, key });
  return true;
}

async function rustupTarget(say) {
  if (!which('rustup')) return false;
  // Where Debian's packages can step in, a hanging download is given up soon; elsewhere it is the only way and may be slow.
  const limitSeconds = mayInstall() ? 60 : 900;
  say(`rustup target add ${target}`);
  const added = await run('rustup', ['target', 'add', target], { limitSeconds });
  return added.code === 0 && works('');
}

/** Makes the target ready and gives the toolchain to build with: '' is the active one. */
export async function wasmTarget(say) {
  const known = proven('wasm');
  if (known && known.key === (await toolchainKey(known.toolchain))) return known.toolchain;
  if (await works('')) return '';
  if (await rustupTarget(say)) return '';
  if (!which('rustup')) throw new Missing(`install Rust from https://rustup.rs, then: rustup target add ${target}`);
  if (await works('debian')) return 'debian';
  if (mayInstall() && (await candidate('rustc-web'))) {
    say("rustup cannot download it; Debian's rustc-web builds it instead (about a minute)");
    await installDebianTarget(target);
    if (await works('debian')) return 'debian';
    await link('debian');
  }
  throw new Missing(`run: rustup target add ${target}`);
}
