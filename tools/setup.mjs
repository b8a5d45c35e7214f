// Prepares the machine: `node tools/setup.mjs start` for building and serving the page, `node tools/setup.mjs test` for every test as well.
// Each step looks first, does only what is missing, and says so in a line; what only the user can do is said in a line with the command.
import { Missing, isMain, seconds } from './run.mjs';
import { cargoTools } from './setup/cargo.mjs';
import { npmPackages } from './setup/npm.mjs';
import { wasmTarget } from './setup/wasm.mjs';
import { chromium } from './setup/browser.mjs';
import { mesa } from './setup/mesa.mjs';
import { pythonPackages } from './setup/python.mjs';

/** Runs one step and gives whether it succeeded. */
async function step(name, prepare) {
  const start = performance.now();
  let acted = false;
  try {
    await prepare((what) => {
      acted = true;
      console.log(`set-up  ${name}: ${what}`);
    });
    if (acted) console.log(`set-up  ${name}: ready after ${seconds(start)}`);
    return true;
  } catch (error) {
    if (!(error instanceof Missing) && error.output) console.error(error.output.trimEnd());
    console.error(`set-up  ${name}: ${error instanceof Missing ? 'please ' : ''}${error.message}`);
    return false;
  }
}

/** Steps in one list wait for each other, lists run beside each other. */
const plans = {
  start: [
    [['wasm32 target', wasmTarget], ['wasm tools', cargoTools]],
    [['npm packages', npmPackages]],
  ],
  test: [
    [['wasm32 target', wasmTarget], ['wasm tools', cargoTools]],
    [['npm packages', npmPackages], ['Chromium', chromium], ['Mesa for WebGPU', mesa]],
    [['Python packages', pythonPackages]],
  ],
};

async function inOrder(steps) {
  let good = true;
  for (const [name, prepare] of steps) good = good && (await step(name, prepare));
  return good;
}

/** Prepares for `start` or `test`; true when all is there. */
export async function setup(purpose) {
  const start = performance.now();
  const results = await Promise.all(plans[purpose].map(inOrder));
  const good = results.every(Boolean);
  console.log(good ? `set-up  all there for ${purpose} (${seconds(start)})` : `set-up  incomplete for ${purpose}`);
  return good;
}

if (isMain(import.meta.url)) {
  const purpose = process.argv[2] ?? 'start';
  if (!(purpose in plans)) {
    console.error(`usage: node tools/setup.mjs ${Object.keys(plans).join('|')}`);
    process.exit(2);
  }
  process.exit((await setup(purpose)) ? 0 : 1);
}
