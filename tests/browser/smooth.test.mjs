// The main thread belongs to the visitor: no task over 50 ms while a room is made, and the view answers the pointer all along.
import assert from 'node:assert/strict';
import { mkdtempSync, rmSync } from 'node:fs';
import { tmpdir } from 'node:os';
import { join } from 'node:path';
import { after, before, test } from 'node:test';
import { visit } from './launch.mjs';
import { put, scan } from './scene.mjs';

let browser;
const folder = mkdtempSync(join(tmpdir(), 'ipdrecon-'));
before(async () => {
  browser = await visit();
});
after(async () => {
  rmSync(folder, { recursive: true });
  await browser.close();
});

/**
 * Makes a journey that gives its long tasks, until it has none: up to three times. A busy machine stretches a task now
 * and then; one that is the page's own comes every time.
 */
async function withoutLongTasks(journey) {
  let tasks;
  for (let attempt = 0; attempt < 3; attempt += 1) {
    tasks = await journey();
    if (tasks.length === 0) return;
  }
  assert.deepEqual(tasks, [], 'long tasks, three times');
}

for (const device of ['gpu', 'auto']) test(`no long task from the click on the sample to the exported file; device ${device}`, () => withoutLongTasks(async () => {
  const visitor = await browser.open({ path: `?device=${device}` });
  await visitor.until('idle');
  await visitor.forget();
  await visitor.page.click('#sample');
  await visitor.until('finished');
  await visitor.download('[data-format=glb]');
  const tasks = await visitor.longTasks();
  await visitor.close();
  return tasks;
}));

for (const device of ['gpu', 'auto']) test(`the view can be turned while the mesh is still growing; device ${device}`, () => withoutLongTasks(async () => {
  const visitor = await browser.open({ path: `?sample&device=${device}` });
  const { page } = visitor;
  await visitor.event('bricks');
  await page.click('#pause');
  await visitor.until('paused');
  await page.waitForTimeout(800);
  const still = await visitor.picture();
  await page.waitForTimeout(300);
  assert.equal((await visitor.picture()).hash, still.hash, 'a held view stands still');
  // Taking pictures is work of the test's own on the page's thread.
  await visitor.forget();
  await page.click('#pause');
  await visitor.until('running');
  const { x, y, width, height } = await page.locator('ipd-recon').boundingBox();
  await page.mouse.move(x + width / 2, y + height / 2);
  await page.mouse.down();
  await page.mouse.move(x + width / 2 + 180, y + height / 2 + 30, { steps: 12 });
  await page.mouse.up();
  const turned = await visitor.event('cameraChanged');
  assert.equal((await visitor.events('finished')).length, 0, 'the view has moved and come to rest before the run was over');
  assert.ok(turned.description.length > 10);
  await visitor.until('finished');
  const tasks = await visitor.longTasks();
  await visitor.close();
  return tasks;
}));

test('on a second visit the engine is ready within a second', async (t) => {
  const visitor = await browser.open();
  await visitor.until('idle');
  const ready_ms = [];
  // The best of five: what else a busy machine does comes and goes.
  for (let visit = 0; visit < 5; visit += 1) {
    await visitor.page.goto(browser.url);
    // `performance.now()` counts from the start of the navigation.
    ready_ms.push((await visitor.event('ready')).at_ms);
  }
  t.diagnostic(`wasm compiled and device up ${ready_ms.map((ms) => ms.toFixed(0)).join(', ')} ms after navigation`);
  assert.ok(Math.min(...ready_ms) < 1000, `${ready_ms}`);
  await visitor.close();
});

test('a folder of 6,000 files is read without a long task', () => withoutLongTasks(async () => {
  const files = scan(12);
  for (let index = 0; index < 6000; index += 1) files[`other/${String(index % 7)}/note-${index}.txt`] = 'no frame';
  files['.hidden/thing.txt'] = files['other/.DS_Store'] = 'left out';
  const many = put(join(folder, 'many'), files);
  const visitor = await browser.open({ path: '?autostart=0' });
  await visitor.until('idle');
  await visitor.forget();
  await visitor.drop(many);
  await visitor.until('planned');
  const tasks = await visitor.longTasks();
  const [opened] = await visitor.events('opened');
  assert.equal(opened.frames, 12);
  await visitor.close();
  return tasks;
}));

test('a scan of 5,000 frames is open in seconds', async (t) => {
  const path = put(join(folder, 'long'), scan(5000));
  const visitor = await browser.open({ path: '?autostart=0' });
  await visitor.until('idle');
  await visitor.forget();
  const start_ms = await visitor.page.evaluate(() => performance.now());
  await visitor.drop(path);
  const planned = await visitor.event('planned');
  const [opened] = await visitor.events('opened');
  assert.equal(opened.frames, 5000);
  const seconds = (planned.at_ms - start_ms) / 1000;
  t.diagnostic(`5,000 frames: planned ${seconds.toFixed(1)} s after the drop`);
  assert.ok(seconds < 15, `${seconds} s`);
  await visitor.close();
});
