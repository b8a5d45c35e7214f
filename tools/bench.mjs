// `npm run bench`: prepares the machine, measures, and writes the tables to BENCHMARKS.md. All rows of a table come from one run.
import { writeFileSync } from 'node:fs';
import { cpus } from 'node:os';
import { join } from 'node:path';
import { buildEnv, gpu } from './env.mjs';
import { must, root } from './run.mjs';
import { setup } from './setup.mjs';

if (!(await setup('test'))) process.exit(1);
const output = await must('cargo', ['bench', '--quiet', '--workspace', '--bench', 'fusion'], { env: gpu(buildEnv()) });
const table = output.split('\n').filter((line) => line.startsWith('|') || line.startsWith('medians')).join('\n').replace('\nmedians', '\n\nmedians');
const machine = `${cpus().length} cores of ${cpus()[0]?.model ?? 'an unknown processor'}`;
const text = `# Benchmarks

Written by \`npm run bench\`. Machines differ and are shared: compare the rows of one table with each other, not with another run's.

## Fusion: \`flex\` (the CPU device) against wgpu, natively

${machine}. Where there is no GPU, wgpu is Mesa's lavapipe, a processor that plays one: the ratios then say nothing about a GPU.
A frame is decoded (the sample room's is drawn while it is read), its bricks are chosen and its depth is integrated; a brick is
classified, placed and its triangles are made.

${table}
`;
writeFileSync(join(root, 'BENCHMARKS.md'), text);
console.log(text);
