// `npm test`: prepares the machine and runs every lane; `npm test native browser` runs those. `--verbose` shows all output as it comes.
// The last line is the count over all tests.
import { join } from 'node:path';
import { run, seconds, toolsDir, write } from './run.mjs';
import { setup } from './setup.mjs';
import { afterSecondTry, count, failures, reasons, sum } from './test/count.mjs';
import { lanes } from './test/lanes.mjs';

const limitSeconds = 3000;
const verbose = process.argv.includes('--verbose');
const named = process.argv.slice(2).filter((word) => !word.startsWith('--'));
const unknown = named.filter((name) => !(name in lanes));
if (unknown.length > 0) {
  console.error(`unknown lane ${unknown.join(', ')}; there are ${Object.keys(lanes).join(', ')}`);
  process.exit(2);
}

/** Runs a command of a lane once. */
async function attempt({ program, env, count: kind }, args) {
  const result = await run(program, args, { env, limitSeconds, show: verbose });
  const note = result.timedOut ? `\nended after ${limitSeconds} s\n` : '';
  const counted = count(kind, result);
  if (counted.failed > 0 && !verbose) console.log(failures(result.output));
  return { counted, output: `$ ${[program, ...args].join(' ')}\n${result.output}${note}` };
}

/** Runs a command of a lane; what failed is run a second time, where the command can name it. */
async function proof(name, command) {
  if (command.skip) return { counted: { passed: 0, failed: 0, skipped: 1 }, output: `skipped: ${command.skip}\n` };
  const first = await attempt(command, command.args);
  const again = first.counted.failed > 0 ? command.again?.(first.output) : undefined;
  if (!again) return first;
  console.log(`lane    ${name}: ${words(first.counted)}; what failed is run a second time …`);
  const second = await attempt(command, again);
  return { counted: afterSecondTry(first.counted, second.counted), output: first.output + second.output };
}

/** Runs one lane to its end, also past a failure, and gives its count. */
async function lane(name) {
  const start = performance.now();
  console.log(`lane    ${name} …`);
  const proofs = [];
  for (const command of await lanes[name]()) proofs.push(await proof(name, command));
  const total = sum(proofs.map(({ counted }) => counted));
  const output = proofs.map(({ output }) => output).join('');
  write(join(toolsDir, 'log', `${name}.log`), output);
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
