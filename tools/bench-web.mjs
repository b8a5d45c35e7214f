// `npm run bench:web`: the network's parts in headless Chromium, WebGPU and the processor, beside ONNX Runtime Web; then whole runs on the page.
// Writes its parts of BENCHMARKS.md. `--quick` measures little and writes nothing; `--views=20,60` takes other
// pieces; `--built` takes the wasm that was built last; `--runs` makes the whole runs alone, on the site as it was built last.
import { existsSync, mkdtempSync, rmSync } from 'node:fs';
import { cpus, tmpdir } from 'node:os';
import { join } from 'node:path';
import { ONNX_RUNTIME, SIZES, commit, folder, prepare } from './bench/prepare.mjs';
import { aboutComparisons, comparisons, record } from './bench/section.mjs';
import { launch } from './browser.mjs';
import { root } from './run.mjs';
import { serve } from './serve.mjs';
import { setup } from './setup.mjs';

const quick = process.argv.includes('--quick');
if (!(await setup('test'))) process.exit(1);
if (process.argv.includes('--runs')) {
  await wholeRuns();
  process.exit(0);
}
console.log('bench   wasm, weights, ONNX Runtime Web');
await prepare({ quick, built: process.argv.includes('--built') });
const views = (process.argv.find((word) => word.startsWith('--views='))?.slice(8) ?? '20,60,100').split(',').map(Number);

/** Runs in the page. */
async function inPage({ gpu, sizes, asked }) {
  // By their addresses: these files lie beside the page alone.
  const at = (name) => new URL(name, location.href).href;
  const { default: init, Bench } = await import(at('bench.js'));
  await init();
  const ort = await import(at(gpu ? 'ort/ort.webgpu.min.mjs' : 'ort/ort.wasm.min.mjs'));
  const { measure } = await import(at('measure.mjs'));
  const bytes = async (name) => new Uint8Array(await (await fetch(name)).arrayBuffer());
  const models = await Promise.all(sizes.map(async ([width, height]) => ({ width, height, bytes: await bytes(`${width}x${height}.onnx`) })));
  const gpuApi = /** @type {any} */ (navigator).gpu;
  const info = gpu ? (await gpuApi.requestAdapter())?.info : null;
  const name = gpu ? `WebGPU (${[info?.vendor, info?.architecture, info?.description].filter(Boolean).join(' ')})` : 'the processor, one thread';
  return { name, ...(await measure({ Bench, ort, gpu, weights: await bytes('weights.safetensors'), models, sizes, ...asked })) };
}

/** The network's parts on each device. */
async function parts() {
  const site = await serve(folder, 0);
  const browser = await launch();
  try {
    const found = [];
    for (const gpu of [true, false]) {
      const page = await browser.newPage();
      page.setDefaultTimeout(0);
      page.on('pageerror', (error) => console.error(`bench   ${error.message}`));
      await page.goto(site.url);
      const asked = quick ? { views: [4], edge: 16, runs: 1, rounds: 1 } : { views, edge: 40, runs: 3, rounds: 7 };
      const { name, ...rest } = await page.evaluate(inPage, { gpu, sizes: quick ? SIZES.slice(0, 1) : SIZES, asked });
      found.push({ device: name, ...rest });
      console.log(`bench   ${name}\n${comparisons(found.slice(-1))}\n${rest.report.markdown}`);
      await page.close();
    }
    return { found, browser: `Chromium ${browser.version()}` };
  } finally {
    await browser.close();
    await site.close();
  }
}

/** Seconds of a whole run on the page, from its own events. */
async function runs() {
  const scan = join(root, '../shared/scans/hololens/scan');
  if (!existsSync(scan)) return 'skipped: the real scan hololens is not beside the repository';
  const { visit } = await import(new URL('../tests/browser/launch.mjs', import.meta.url).href);
  const { choose, withoutDepth } = await import(new URL('../tests/browser/photos.mjs', import.meta.url).href);
  const out = mkdtempSync(join(tmpdir(), 'ipdrecon-'));
  const browser = await visit();
  try {
    const rows = [];
    for (const device of ['gpu', 'auto', 'cpu']) {
      const visitor = await browser.open({ path: `?autostart=0&device=${device}` });
      await visitor.until('idle');
      await visitor.drop(withoutDepth(scan, join(out, device)));
      await visitor.until('planned');
      await choose(visitor, { Keyframes: '20' });
      const started_ms = await visitor.page.evaluate(() => performance.now());
      await visitor.page.click('#run');
      await visitor.within(900_000, 'finished');
      const [finished] = await visitor.events('finished');
      const [first] = (await visitor.events('bricks')).filter(({ triangles }) => triangles > 0);
      const stages = (await visitor.events('stage')).filter(({ at_ms }) => at_ms > started_ms);
      const seconds = (from, to) => ((to - from) / 1000).toFixed(1);
      const each = stages.map(({ stage, at_ms }, i) => `${stage} ${seconds(at_ms, stages[i + 1]?.at_ms ?? finished.at_ms)}`);
      rows.push(`| \`${device}\` | ${seconds(started_ms, first.at_ms)} | ${seconds(started_ms, finished.at_ms)} | ${each.join(', ')} |`);
      await visitor.close();
    }
    return `The scan hololens without its depth, 20 keyframes, from the click on. \`gpu\` computes on WebGPU even where that is software, \`auto\` then on the processor while the adapter draws:\n\n| device | first surface s | total s | seconds of each stage |\n|---|---|---|---|\n${rows.join('\n')}`;
  } finally {
    await browser.close();
    rmSync(out, { recursive: true });
  }
}

/** Measures them and writes them down. */
async function wholeRuns() {
  const whole = await runs();
  record('bench-web-runs', `### Whole runs of the network on the page\n\n${whole}`);
  console.log(whole);
}

const { found, browser } = await parts();
if (quick) {
  const bad = found.flatMap(({ comparisons }) => comparisons).filter(({ failed }) => failed);
  process.exit(bad.length > 0 ? 1 : 0);
}
const text = `## The network in a browser: \`npm run bench:web\`

${browser}, headless, on ${cpus().length} cores of ${cpus()[0]?.model ?? 'an unknown processor'}; commit ${await commit()}. Where WebGPU is SwiftShader, a processor plays a GPU.

### 2D features beside ONNX Runtime Web

${aboutComparisons(ONNX_RUNTIME)}

${comparisons(found)}

${found.map(({ device, report }) => `### Parts on ${device}\n\n${report.markdown}`).join('\n\n')}`;
record('bench-web', text);
const { build } = await import('./build.mjs');
await build();
await wholeRuns();
