// `npm run bench:native`: the network's parts natively, on the processor and on the GPU, kernels beside tensor operations, attention's memory, and PyTorch where
// Python has it. Writes its part of BENCHMARKS.md. On Linux the GPU is Mesa's software device, as in the tests; `--gpu` takes the machine's.
import { cpus } from 'node:os';
import { commit } from './bench/prepare.mjs';
import { record } from './bench/section.mjs';
import { buildEnv, gpu as software, python } from './env.mjs';
import { must, run } from './run.mjs';
import { setup } from './setup.mjs';

if (!(await setup('test'))) process.exit(1);
const env = process.argv.includes('--gpu') ? buildEnv() : software(buildEnv());
await must('cargo', ['build', '--release', '--locked', '--workspace', '--bin', 'ipdrecon'], { env });

/** Shows a program's tables as they come. */
async function tables(program, ...args) {
  const output = await must(program, args, { env });
  console.log(output);
  // The program's own last line says the commit, which stands above.
  return output.split('\n').filter((line) => line.startsWith('|') || line.startsWith('Peak') || line.startsWith('on ') || line === '').join('\n').trim();
}
const bench = (...args) => tables('target/release/ipdrecon', 'bench', ...args);

const processor = await bench();
const gpu = await bench('--device', 'gpu', '--views', '20', '--runs', '5');
const plain = await bench('--device', 'gpu', '--plain', '--size', '160x120', '--runs', '3');
const memory = await tables('cargo', 'bench', '--quiet', '--locked', '--workspace', '--bench', 'attention_memory');
const text = `## The network natively: \`npm run bench:native\`

On ${cpus().length} cores of ${cpus()[0]?.model ?? 'an unknown processor'}; commit ${await commit()}. The released weights; a piece is a cube of 1.6 m with every voxel occupied, seen by so many views of 160x120 (the
protocol of the paper's Table 6), fused in the blocks of a run. Cold: the first run, in which pipelines are compiled; warm: the median of up to nine. A stage is waited
for on its own, so stages come to more than the whole. Only convolutions, linear layers and attention are counted as operations and bytes
(\`crate/bench/src/work.rs\`). The peak is measured: a product of matrices or, on a GPU, products in registers; and a copy of 64 MiB.

${processor}

${gpu}

### Kernels beside the tensor operations that they stand for

The same network on the same GPU with every kernel switched off.

${plain}

### Memory of attention, 1,000 voxels of 40 channels on the processor

Beyond its inputs, counted by the allocator.

${memory}`;
record('bench-native', text);

/** PyTorch is large, so nothing installs it; another Python that has it is named by IPDRECON_TORCH_PYTHON. */
const torchPython = process.env.IPDRECON_TORCH_PYTHON ?? python;
const has = await run(torchPython, ['-c', 'import torch'], { env });
const torch = has.code === 0
  ? (await must(torchPython, ['tests/reference/speed.py', '--views', '20,60,100', '--rounds', '1'], { env })).trim()
  : 'skipped: Python has no PyTorch here; `pip install torch`, or name a Python that has it in IPDRECON_TORCH_PYTHON';
record('bench-native-pytorch', `### PyTorch on the same processor\n\n${torch}`);
console.log(torch);
