// What both benches in wasm need, in one folder below .tools: our wasm, the weights, ONNX Runtime Web and the models for it.
import { cpSync, existsSync, mkdirSync, readFileSync, rmSync, writeFileSync } from 'node:fs';
import { join } from 'node:path';
import { buildEnv, wasmEnv } from '../env.mjs';
import { must, root, run, toolsDir } from '../run.mjs';
import { optimise } from '../wasm-opt.mjs';
import { model, tensors } from './onnx.mjs';

/** The peer. It is no dependency of the project: asked for by a bench, it comes from the npm registry. */
export const ONNX_RUNTIME = 'onnxruntime-web@1.30.0';
/** The network's own pictures and the paper's. */
export const SIZES = [[160, 120], [640, 480]];
export const folder = join(toolsDir, 'bench');
const target = 'wasm32-unknown-unknown';

/** The worker is named beside the bench, so that cargo settles on the engine's features and burn is not compiled again. */
async function wasm(quick) {
  const cargo = process.env.CARGO_TARGET_DIR ?? join(root, 'target');
  await must('cargo', ['build', '--quiet', '--locked', '--target', target, '--profile', 'web', '-p', 'worker', '-p', 'bench'], { env: { ...wasmEnv(), CARGO_TARGET_DIR: cargo } });
  await must('wasm-bindgen', ['--target', 'web', '--out-dir', folder, '--out-name', 'bench', join(cargo, target, 'web/bench.wasm')], { env: buildEnv() });
  if (!quick) await optimise(join(folder, 'bench_bg.wasm'));
}

async function onnxRuntime() {
  const home = join(toolsDir, 'onnxruntime');
  const [name, version] = ONNX_RUNTIME.split('@');
  const manifest = join(home, 'node_modules', name, 'package.json');
  if (!existsSync(manifest) || JSON.parse(readFileSync(manifest, 'utf8')).version !== version) {
    mkdirSync(home, { recursive: true });
    await must('npm', ['install', '--no-save', '--no-audit', '--no-fund', '--ignore-scripts', '--prefix', home, ONNX_RUNTIME]);
  }
  const dist = join(home, 'node_modules', name, 'dist');
  rmSync(join(folder, 'ort'), { recursive: true, force: true });
  cpSync(dist, join(folder, 'ort'), { recursive: true, filter: (path) => !path.endsWith('.map') });
}

/** Makes the folder; with `built` our wasm is the one that lies there. */
export async function prepare({ quick = false, built = false } = {}) {
  mkdirSync(folder, { recursive: true });
  if (!built) await wasm(quick);
  await onnxRuntime();
  const weights = readFileSync(join(root, 'weights/ipdrecon.safetensors'));
  writeFileSync(join(folder, 'weights.safetensors'), weights);
  const found = tensors(weights);
  for (const [width, height] of SIZES) writeFileSync(join(folder, `${width}x${height}.onnx`), model(found, width, height));
  cpSync(join(root, 'tools/bench/measure.mjs'), join(folder, 'measure.mjs'));
  writeFileSync(join(folder, 'index.html'), '<!doctype html><meta charset="utf-8"><title>bench</title>\n');
}

/** Which commit is measured; `+` where the tree differs from it. */
export async function commit() {
  const found = await run('git', ['describe', '--always', '--dirty=+'], { cwd: root });
  return found.code === 0 ? found.output.trim() : 'unknown';
}
