// The lanes of `npm test`, in the order in which a mistake shows soonest. A lane is a list of commands; each says how its tests are counted.
import { existsSync, readdirSync } from 'node:fs';
import { dirname, join } from 'node:path';
import { pathToFileURL } from 'node:url';
import { buildEnv, gpu, python, wasmEnv } from '../env.mjs';
import { must, root, run } from '../run.mjs';
import { target } from '../setup/wasm.mjs';

const at = (...parts) => join(root, ...parts);
const tsc = at('node_modules/typescript/bin/tsc');

/** A lane that has lost its tests fails, and says so. */
const nothing = (why) => ({ program: process.execPath, args: ['-e', `console.error(${JSON.stringify(why)}); process.exit(1)`], env: process.env, count: 'check' });

const check = (program, ...args) => ({ program, args, env: buildEnv(), count: 'check' });

/** `node --test` of the test files of some folders, one after the other: some of their figures are times. */
function nodeTests(...folders) {
  const files = folders.filter((folder) => existsSync(at(folder)))
    .flatMap((folder) => readdirSync(at(folder)).filter((name) => name.endsWith('.test.mjs')).sort().map((name) => join(folder, name)));
  if (files.length === 0) return nothing(`no *.test.mjs in ${folders.join(', ')}`);
  return { program: process.execPath, args: ['--test', '--test-concurrency=1', '--test-reporter=spec', ...files], env: buildEnv(), count: 'node' };
}

const cargo = (env, ...args) => ({ program: 'cargo', args, env, count: 'check' });

/** The crates whose kernels are tested under Node: those with wasm-bindgen-test among their dependencies for tests. */
async function kernelCrates() {
  const metadata = JSON.parse(await must('cargo', ['metadata', '--format-version', '1', '--no-deps', '--locked'], { env: buildEnv() }));
  return metadata.packages.filter(({ dependencies }) => dependencies.some(({ name, kind }) => name === 'wasm-bindgen-test' && kind === 'dev'));
}

/** One call for all kernels. The worker is named beside them, so that cargo settles on the features of the engine and burn is not compiled again. */
async function kernels() {
  const crates = await kernelCrates();
  if (crates.length === 0) return nothing('no crate has wasm-bindgen-test among its dev-dependencies');
  const env = { ...gpu(wasmEnv()), NODE_OPTIONS: `--import ${pathToFileURL(at('tools/webgpu-preload.mjs')).href}` };
  const packages = ['worker', ...crates.map(({ name }) => name)].flatMap((name) => ['-p', name]);
  const args = ['test', '--node', '--mode', 'no-install', dirname(crates[0].manifest_path), '--profile', 'web', ...packages];
  return { program: 'wasm-pack', args, env, count: 'cargo' };
}

async function wasmClippy() {
  const env = wasmEnv();
  if ((await run('cargo', ['clippy', '--version'], { env })).code !== 0) return { skip: 'clippy for wasm: the toolchain that builds wasm here has no clippy' };
  return cargo(env, 'clippy', '--locked', '-p', 'worker', '--target', target, '--profile', 'web', '--', '-D', 'warnings');
}

export const lanes = {
  fmt: async () => [cargo(buildEnv(), 'fmt', '--all', '--check')],
  types: async () => [check(process.execPath, tsc, '--noEmit', '-p', 'tsconfig.json')],
  tools: async () => [nodeTests('tools', 'tools/bench', 'tools/test')],
  clippy: async () => [cargo(buildEnv(), 'clippy', '--locked', '--release', '--workspace', '--all-targets', '--', '-D', 'warnings'), await wasmClippy()],
  native: async () => [{ ...cargo(gpu(buildEnv()), 'test', '--release', '--workspace', '--no-fail-fast', '--', '--show-output'), count: 'cargo' }],
  build: async () => [check(process.execPath, 'tools/build.mjs')],
  wasm: async () => [await kernels()],
  browser: async () => [nodeTests('tests/browser')],
  reference: async () => [{ program: python, args: ['-m', 'unittest', 'discover', '-v', '-s', 'tests/reference', '-p', 'test_*.py'], env: buildEnv(), count: 'python' }],
  budget: async () => [nodeTests('tests/budget')],
};
