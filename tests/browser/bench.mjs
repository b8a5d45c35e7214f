// How fast the page is: WebGPU against its own CPU device, the same scans in one run, as a Markdown table.
import { existsSync } from 'node:fs';
import { join } from 'node:path';
import { root } from '../../tools/run.mjs';
import { visit } from './launch.mjs';

const RUNS = 3;
const shared = (name) => join(root, '../shared/scans', name, 'scan');
const scans = [
  { name: 'sample room', open: (visitor) => visitor.page.getByRole('button', { name: 'Try the sample room' }).click() },
  ...['hololens', 'livingroom'].filter((name) => existsSync(shared(name))).map((name) => ({ name, open: (visitor) => visitor.drop(shared(name)) })),
];
/** The same without depth images, or with them left aside. */
const photos = scans.map((scan) => ({ ...scan, attributes: { depth: 'stereo', views: '30', 'stereo-size': '160x120' } }));
const median = (values) => values.sort((a, b) => a - b)[Math.floor(values.length / 2)];

/** Seconds from the drop to the first surface and to the end, and milliseconds a frame, of one visit. */
async function measure(browser, { open, attributes = {} }, device) {
  const visitor = await browser.open({ path: `?device=${device}` });
  await visitor.until('idle');
  const [{ device: found }] = await visitor.events('ready');
  await visitor.page.evaluate((attributes) => Object.entries(attributes).forEach(([name, value]) => document.querySelector('ipd-recon').setAttribute(name, value)), attributes);
  await visitor.forget();
  const start_ms = await visitor.page.evaluate(() => performance.now());
  await open(visitor);
  await visitor.within(600_000, 'finished');
  const [finished] = await visitor.events('finished');
  const { plan } = (await visitor.events('planned')).at(-1);
  const [first] = (await visitor.events('bricks')).filter(({ triangles }) => triangles > 0);
  await visitor.close();
  const seconds = ({ at_ms }) => (at_ms - start_ms) / 1000;
  return { found, first_s: seconds(first), total_s: seconds(finished), frame_ms: (finished.elapsedS * 1000) / plan.keyframes };
}

/** The tables; the site must be built. */
export async function table() {
  const browser = await visit();
  try {
    const fusion = await rowsOf(browser, scans, RUNS);
    const stereo = await rowsOf(browser, photos, 1);
    return `${fusion}\n\n### Depth from the photos: 160x120, 30 views\n\n${stereo.replace('ms a frame', 'ms a keyframe')}`;
  } finally {
    await browser.close();
  }
}

async function rowsOf(browser, scans, times) {
  const rows = ['| scan | device | first surface s | ms a frame, surfaces included | total s |', '|---|---|---|---|---|'];
  for (const scan of scans) {
    const runs = { gpu: [], cpu: [] };
    // In turn, so that a change of the machine's speed falls on both.
    for (let i = 0; i < times; i++) for (const device of Object.keys(runs)) runs[device].push(await measure(browser, scan, device));
    const medians = Object.values(runs).map((list) => ['first_s', 'frame_ms', 'total_s'].map((column) => median(list.map((run) => run[column]))));
    Object.values(runs).forEach(([{ found }], i) => rows.push(`| ${scan.name} | ${found} | ${medians[i].map((value) => value.toFixed(value < 10 ? 2 : 1)).join(' | ')} |`));
    rows.push(`| ${scan.name} | webgpu / cpu | ${medians[0].map((value, i) => (value / medians[1][i]).toFixed(2)).join(' | ')} |`);
  }
  return `${rows.join('\n')}\n\n${times > 1 ? `medians of ${times} runs` : 'one run'}, from the drop on`;
}
