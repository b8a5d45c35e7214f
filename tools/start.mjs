// `npm start`: prepares the machine, builds the page, serves it and prints its address.
import { join } from 'node:path';
import { root } from './run.mjs';
import { build } from './build.mjs';
import { serve } from './serve.mjs';
import { setup } from './setup.mjs';

if (!(await setup('start'))) process.exit(1);
try {
  await build({ quick: process.argv.includes('--quick') });
} catch (error) {
  if (error.output) console.error(error.output.trimEnd());
  console.error(`build   failed: ${error.message}`);
  process.exit(1);
}
const { url } = await serve(join(root, 'www/dist'));
console.log(`serve   ${url} (Ctrl+C ends it)`);
