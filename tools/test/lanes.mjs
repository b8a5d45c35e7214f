// The lanes of `npm test`, in the order in which a mistake shows soonest. A lane is a list of commands; each says how its tests are counted,
// and those with figures in seconds how to run what failed a second time, when whatever else the machine did may be over.
import { existsSync, readdirSync } from 'node:fs';
import { dirname, join } from 'node:path';
import { pathToFileURL } from 'node:url';
import { buildEnv, gpu, python, wasmEnv } from '../env.mjs';
import { must, root, run } from '../run.mjs';
import { target } from '../setup/wasm.mjs';
import { failedFiles, failedTargets } from './count.mjs';

const at = (...parts) => join(root, ...parts);
const tsc = at('node_modules/typescript/bin/tsc');

/** A lane that has lost its tests fails, and says so. */
const nothing = (why) => ({ program: process.execPath, args: ['-e', `console.error(${JSON.stringify(why)}); process.exit(1)`], env: process.env, count: 'check' });

const check = (program, ...args) => ({ program, args, env: buildEnv(), count: 'check' });

/** The arguments of a second run, or null where the output does not name what failed. */
const someOf = (failed, args) => (output) => {
  const found = failed(output);
  return found.length > 0 ? args(found) : null;
};

/** `node --test` of the test files of some folders, one after the other: some of their figures are times. */
function nodeTests(...folders) {
  const files = folders.filter((folder) => existsSync(at(folder)))
    .flatMap((folder) => readdirSync(at(folder)).filter((name) => name.endsWith('.test.mjs')).sort().map((name) => join(folder, name)));
  if (files.length === 0) return nothing(`no *.test.mjs in ${folders.join(', ')}`);
  const of = (files) => ['--test', '--test-concurrency=1', '--test-reporter=spec', ...files];
  return { program: process.execPath, args: of(files), env: buildEnv(), count: 'node', again: someOf(failedFiles, of) };
}

const cargo = (env, ...args) => ({ program: 'cargo', args, env, count: 'check' });

/** Every test of every crate. What failed is run again by the name of its target, never of its package: that would change burn's features. */
function native() {
  const of = (targets) => ['test', '--release', '--workspace', '--no-fail-fast', ...targets, '--', '--show-output'];
  return { ...cargo(gpu(buildEnv()), ...of([])), count: 'cargo', again: someOf(failedTargets, of) };
}

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
  native: async () => [native()],
  build: async () => [check(process.execPath, 'tools/build.mjs')],
  wasm: async () => [await kernels()],
  browser: async () => [nodeTests('tests/browser')],
  reference: async () => [{ program: python, args: ['-m', 'unittest', 'discover', '-v', '-s', 'tests/reference', '-p', 'test_*.py'], env: buildEnv(), count: 'python' }],
  budget: async () => [nodeTests('tests/budget')],
};
