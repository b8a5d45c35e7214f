// The environment that builds and tests run in: which toolchain, which tools, which GPU. Reads only what the set-up has proven.
import { existsSync, mkdirSync } from 'node:fs';
import { tmpdir } from 'node:os';
import { delimiter, join } from 'node:path';
import { root, toolsDir } from './run.mjs';
import { proven } from './setup/state.mjs';

/** For every program: the tools of .tools first. RUSTFLAGS would silently replace the flags of .cargo/config.toml. */
export function buildEnv() {
  const { RUSTFLAGS, ...rest } = process.env;
  return { ...rest, PATH: [join(toolsDir, 'bin'), join(root, 'node_modules/.bin'), rest.PATH].join(delimiter) };
}

/** For builds of wasm: the toolchain that was shown to link for it. */
export function wasmEnv() {
  const toolchain = proven('wasm')?.toolchain;
  return toolchain ? { ...buildEnv(), RUSTUP_TOOLCHAIN: toolchain } : buildEnv();
}

const icds = ['/usr/share/vulkan/icd.d', '/usr/local/share/vulkan/icd.d', '/etc/vulkan/icd.d']
  .flatMap((folder) => ['lvp_icd.json', 'lvp_icd.x86_64.json', 'lvp_icd.aarch64.json'].map((name) => join(folder, name)));

/** Mesa's software Vulkan device, or null. */
export const lavapipe = () => icds.find((path) => existsSync(path)) ?? null;

/** Tests on a GPU see lavapipe alone, so that every machine computes on the same device. */
export function gpu(env) {
  const runtime = env.XDG_RUNTIME_DIR ?? join(tmpdir(), 'ipdrecon-runtime');
  mkdirSync(runtime, { recursive: true, mode: 0o700 });
  const icd = process.platform === 'linux' ? lavapipe() : null;
  return { ...env, XDG_RUNTIME_DIR: runtime, ...(icd ? { VK_ICD_FILENAMES: icd, VK_DRIVER_FILES: icd } : {}) };
}

/** The Python of tests/reference, with the packages of its requirements. */
export const python = join(toolsDir, 'venv', process.platform === 'win32' ? 'Scripts/python.exe' : 'bin/python');
