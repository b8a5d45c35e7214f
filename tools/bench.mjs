// `npm run bench`: prepares the machine, measures, and writes the tables to BENCHMARKS.md. All rows of a table come from one run.
import { writeFileSync } from 'node:fs';
import { cpus } from 'node:os';
import { join } from 'node:path';
import { buildEnv, gpu } from './env.mjs';
import { must, root } from './run.mjs';
import { setup } from './setup.mjs';

if (!(await setup('test'))) process.exit(1);
const { build } = await import('./build.mjs');
await build();
const output = await must('cargo', ['bench', '--quiet', '--workspace', '--bench', 'fusion'], { env: gpu(buildEnv()) });
const native = output.split('\n').filter((line) => line.startsWith('|') || line.startsWith('medians')).join('\n').replace('\nmedians', '\n\nmedians');
// By its address: the type check of the tools does not follow into the tests.
const browser = await (await import(new URL('../tests/browser/bench.mjs', import.meta.url).href)).table();
const text = `# Benchmarks

Written by \`npm run bench\` on ${cpus().length} cores of ${cpus()[0]?.model ?? 'an unknown processor'}. Machines differ and are shared: compare the rows of one table with each
other, not with another run's. Where there is no GPU, wgpu is Mesa's lavapipe and Chromium's WebGPU is SwiftShader, processors that
play one: the ratios then say nothing about a GPU. The real scans are not part of this repository.

## Fusion on the command line: \`flex\` (the CPU device, all cores) against wgpu

A frame is decoded (the sample room's is drawn while it is read), its bricks are chosen and its depth is integrated; a brick is
classified, placed and its triangles are made.

${native}

## Fusion on the page: WebGPU against the CPU device (one thread), with pictures drawn meanwhile

${browser}
`;
writeFileSync(join(root, 'BENCHMARKS.md'), text);
console.log(text);
