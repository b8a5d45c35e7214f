// `npm run bench`: prepares the machine, measures, and writes the tables to BENCHMARKS.md. All rows of a table come from one run.
import { readFileSync, writeFileSync } from 'node:fs';
import { cpus } from 'node:os';
import { join } from 'node:path';
import { sections } from './bench/section.mjs';
import { buildEnv, gpu } from './env.mjs';
import { must, root } from './run.mjs';
import { setup } from './setup.mjs';

if (!(await setup('test'))) process.exit(1);
const { build } = await import('./build.mjs');
await build();

/** The table of a bench, what it could not measure, and what its figures are. */
async function native(bench) {
  const output = await must('cargo', ['bench', '--quiet', '--workspace', '--bench', bench], { env: gpu(buildEnv()) });
  const lines = output.split('\n');
  const table = lines.filter((line) => line.startsWith('|'));
  const notes = [...new Set(lines.filter((line) => line.startsWith('skipped') || line.startsWith('medians')))];
  return [...table, '', ...notes.flatMap((note) => [note, ''])].join('\n').trimEnd();
}

const fusion = await native('fusion');
const stereo = await native('stereo');
const step = await native('step');
// By its address: the type check of the tools does not follow into the tests.
const browser = await (await import(new URL('../tests/browser/bench.mjs', import.meta.url).href)).table();
const text = `# Benchmarks

Written by \`npm run bench\` on ${cpus().length} cores of ${cpus()[0]?.model ?? 'an unknown processor'}. Machines differ and are shared: compare the rows of one table with each
other, not with another run's. Where there is no GPU, wgpu is Mesa's lavapipe and Chromium's WebGPU is SwiftShader, processors that
play one: the ratios then say nothing about a GPU. The real scans are not part of this repository.

## Fusion on the command line: \`flex\` (the CPU device, all cores) against wgpu

A frame is decoded (the sample room's is drawn while it is read), its bricks are chosen and its depth is integrated; a brick is
classified, placed and its triangles are made.

${fusion}

## Depth from colour alone on the command line: \`flex\` and wgpu against Python

A keyframe is matched with up to 12 sources on 128 planes and then on 17 around its local planes; pictures are decoded, kernels and
numba's functions compiled before. *numpy* is \`tests/reference/stereo.py\` with NumPy's sweep in a pool of threads and numba for
smoothing and local planes; *numba* is the same with a sweep that numba compiles too. They take turns keyframe by keyframe, with the
same threads; CPU seconds are those of all threads. GFLOP/s and GB/s count what the kernels do and must move
(\`crate/stereo/src/fused/work.rs\`). Equal mean ZNCC says that all did the same work.

${stereo}

## A training step on the processor

One crop of 2.56 x 2.56 x 1.92 m with eight pictures of 160x128, all of which see nearly all of it; best of three steps.

${step}

## Fusion on the page: WebGPU against the CPU device (one thread), with pictures drawn meanwhile

${browser}
`;
const file = join(root, 'BENCHMARKS.md');
writeFileSync(file, `${text}\n${sections(readFileSync(file, 'utf8'))}\n`);
console.log(text);
