// `npm run bench:node`: the same wasm as in `bench:web` under Node, on Dawn's WebGPU (a real GPU where the machine has one) and on the processor, beside ONNX
// Runtime Web. Writes its part of BENCHMARKS.md. `--quick`, `--views=20,60` and `--built` as there; `--gpu` takes what GPU the machine has, without it
// Linux's software device alone is seen, as in the tests.
import './webgpu-preload.mjs';
import { readFileSync } from 'node:fs';
import { cpus } from 'node:os';
import { join } from 'node:path';
import { pathToFileURL } from 'node:url';
import { measure } from './bench/measure.mjs';
import { ONNX_RUNTIME, SIZES, commit, folder, prepare } from './bench/prepare.mjs';
import { aboutComparisons, comparisons, record } from './bench/section.mjs';
import { gpu as software } from './env.mjs';
import { setup } from './setup.mjs';

const quick = process.argv.includes('--quick');
if (!process.argv.includes('--gpu')) Object.assign(process.env, software(process.env));
if (!(await setup('test'))) process.exit(1);
console.log('bench   wasm, weights, ONNX Runtime Web');
await prepare({ quick, built: process.argv.includes('--built') });
const views = (process.argv.find((word) => word.startsWith('--views='))?.slice(8) ?? '20,60,100').split(',').map(Number);

const file = (name) => new Uint8Array(readFileSync(join(folder, name)));
const load = (name) => import(pathToFileURL(join(folder, name)).href);
const { default: init, Bench } = await load('bench.js');
await init({ module_or_path: file('bench_bg.wasm') });

const found = [];
for (const gpu of [true, false]) {
  const ort = await load(gpu ? 'ort/ort.webgpu.min.mjs' : 'ort/ort.wasm.min.mjs');
  const sizes = quick ? SIZES.slice(0, 1) : SIZES;
  const models = sizes.map(([width, height]) => ({ width, height, bytes: file(`${width}x${height}.onnx`) }));
  const api = /** @type {any} */ (navigator).gpu;
  const info = gpu ? (await api.requestAdapter())?.info : null;
  const device = gpu ? `Dawn's WebGPU (${[info?.vendor, info?.architecture, info?.description].filter(Boolean).join(' ')})` : 'the processor, one thread';
  const asked = quick ? { views: [4], edge: 16, runs: 1, rounds: 1 } : { views, edge: 40, runs: 3, rounds: 7 };
  found.push({ device, ...(await measure({ Bench, ort, gpu, weights: file('weights.safetensors'), models, sizes, ...asked })) });
  console.log(`bench   ${device}\n${comparisons(found.slice(-1))}\n${found.at(-1).report.markdown}`);
}
if (!quick) {
  record('bench-node', `## The network in wasm under Node: \`npm run bench:node\`

Node ${process.version} on ${cpus().length} cores of ${cpus()[0]?.model ?? 'an unknown processor'}; commit ${await commit()}. Where Dawn's device is llvmpipe, a processor plays a GPU.

### 2D features beside ONNX Runtime Web

${aboutComparisons(ONNX_RUNTIME)}

${comparisons(found)}

${found.map(({ device, report }) => `### Parts on ${device}\n\n${report.markdown}`).join('\n\n')}`);
}
// Dawn's device keeps Node alive.
process.exit(0);
