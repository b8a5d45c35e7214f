// `npm test`: prepares the machine and runs every lane; `npm test native browser` runs those. `--verbose` shows all output as it comes.
// The last line is the count over all tests.
import { join } from 'node:path';
import { run, seconds, toolsDir, write } from './run.mjs';
import { setup } from './setup.mjs';
import { count, failures, reasons, sum } from './test/count.mjs';
import { lanes } from './test/lanes.mjs';

const limitSeconds = 2400;
const verbose = process.argv.includes('--verbose');
const named = process.argv.slice(2).filter((word) => !word.startsWith('--'));
const unknown = named.filter((name) => !(name in lanes));
if (unknown.length > 0) {
  console.error(`unknown lane ${unknown.join(', ')}; there are ${Object.keys(lanes).join(', ')}`);
  process.exit(2);
}

/** Runs one lane to its end, also past a failure, and gives its count. */
async function lane(name) {
  const start = performance.now();
  console.log(`lane    ${name} …`);
  const counts = [];
  let output = '';
  for (const { skip, program, args, env, count: kind } of await lanes[name]()) {
    if (skip) {
      output += `skipped: ${skip}\n`;
      counts.push({ passed: 0, failed: 0, skipped: 1 });
      continue;
    }
    const result = await run(program, args, { env, limitSeconds, show: verbose });
    const note = result.timedOut ? `\nended after ${limitSeconds} s\n` : '';
    output += `$ ${[program, ...args].join(' ')}\n${result.output}${note}`;
    counts.push(count(kind, result));
  }
  const total = sum(counts);
  const log = join(toolsDir, 'log', `${name}.log`);
  write(log, output);
  if (total.failed > 0 && !verbose) console.log(failures(output));
  for (const reason of reasons(output)) console.log(`        ${reason}`);
  console.log(`lane    ${name}: ${total.failed > 0 ? 'FAILED' : 'ok'}, ${words(total)} (${seconds(start)})`);
  return { name, total };
}

const words = ({ passed, failed, skipped }) => `${passed} passed, ${failed} failed, ${skipped} skipped`;

const start = performance.now();
if (!(await setup('test'))) {
  console.log(words({ passed: 0, failed: 1, skipped: 0 }));
  process.exit(1);
}
const results = [];
for (const name of named.length > 0 ? named : Object.keys(lanes)) results.push(await lane(name));

const total = sum(results.map((result) => result.total));
const bad = results.filter((result) => result.total.failed > 0).map((result) => result.name);
console.log(`\ntested in ${seconds(start)}${bad.length > 0 ? `; FAILED: ${bad.join(', ')}` : ''}`);
console.log(words(total));
process.exit(bad.length > 0 ? 1 : 0);
