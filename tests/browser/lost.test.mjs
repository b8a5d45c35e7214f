// A graphics device may be lost at any time: another engine goes on after the last stage that was finished, and nothing is lost.
import assert from 'node:assert/strict';
import { mkdtempSync, readFileSync, rmSync } from 'node:fs';
import { tmpdir } from 'node:os';
import { join } from 'node:path';
import { after, before, test } from 'node:test';
import { chamfer, vertices } from './chamfer.mjs';
import { build, sampleFolder } from './command-line.mjs';
import { visit } from './launch.mjs';
import { save, stages, withoutDepth } from './photos.mjs';

const out = mkdtempSync(join(tmpdir(), 'ipdrecon-'));
const photos = join(out, 'photos');
let browser;
before(async () => {
  await build();
  await sampleFolder(join(out, 'sample-room'));
  withoutDepth(join(out, 'sample-room'), photos);
  browser = await visit();
});
after(async () => {
  rmSync(out, { recursive: true });
  await browser.close();
});

/** Stages that are not done twice. */
const SLOW = ['matching', 'coarse', 'medium', 'fine', 'coloring'];
/** Before the worker script: a device that the page can have destroyed, which is how a browser takes one away. */
const LOSABLE = `{
  const request = GPUAdapter.prototype.requestDevice;
  GPUAdapter.prototype.requestDevice = async function (...options) {
    const device = await request.apply(this, options);
    new BroadcastChannel('lose').onmessage = () => device.destroy();
    return device;
  };
}
`;

async function open(path, state = 'idle') {
  const before = (page) => page.context().route('**/worker.js', async (route) => {
    const answer = await route.fetch();
    await route.fulfill({ response: answer, body: LOSABLE + await answer.text() });
  });
  const visitor = await browser.open({ path, before });
  await visitor.until(state);
  return visitor;
}

const lose = ({ page }) => page.evaluate(() => new BroadcastChannel('lose').postMessage(0));
const reached = ({ page }, stage) => page.waitForFunction((stage) => window.record.events.some((event) => event.stage === stage), stage, { timeout: 180_000, polling: 20 });
const losses = async (visitor) => (await visitor.events('finding')).filter(({ finding }) => finding.code === 'device-lost');

/** A page that works on WebGPU, with the photos planned and the run begun. */
async function begun() {
  const visitor = await open('?autostart=0&device=gpu');
  await visitor.drop(photos);
  await visitor.until('planned');
  await visitor.page.evaluate(() => void document.querySelector('ipd-recon').run({ views: 8 }).catch(() => undefined));
  return visitor;
}

test('the network goes on after the last finished stage, and makes the same mesh', async (t) => {
  const whole = await begun();
  await whole.within(400_000, 'finished');
  const straight = vertices(readFileSync(await save(whole, join(out, 'straight.ply'))));
  await whole.close();
  const visitor = await begun();
  await reached(visitor, 'fine');
  await lose(visitor);
  await visitor.event('finding', 60_000);
  await visitor.within(400_000, 'finished');
  assert.equal((await losses(visitor)).length, 1, 'the visitor is told');
  assert.deepEqual(await visitor.events('failed'), []);
  const all = await stages(visitor);
  const again = all.slice(all.lastIndexOf('opening'));
  assert.deepEqual(again.filter((stage) => SLOW.includes(stage)), ['fine', 'coloring'], `all stages: ${all}`);
  const distance_m = chamfer(vertices(readFileSync(await save(visitor, join(out, 'resumed.ply')))), straight);
  t.diagnostic(`lost in the finest level: then ${again.join(', ')}; chamfer to a straight run ${(distance_m * 1000).toFixed(4)} mm`);
  assert.ok(distance_m < 1e-4);
  await visitor.close();
});

test('a run that was held is held again by the engine that takes over', async () => {
  const visitor = await open('?sample&autostart=0&device=gpu', 'planned');
  await visitor.page.click('#run');
  await visitor.event('bricks');
  await visitor.page.click('#pause');
  await visitor.until('paused');
  await visitor.forget();
  await lose(visitor);
  await visitor.event('paused');
  await visitor.until('paused');
  assert.equal((await losses(visitor)).length, 1);
  assert.deepEqual(await visitor.events('finished'), []);
  await visitor.page.click('#pause');
  await visitor.until('finished');
  assert.deepEqual(visitor.errors, []);
  await visitor.close();
});

test('a mesh that was finished comes back; a device that is lost again leaves the work to the processor', async () => {
  const visitor = await open('?device=gpu');
  await visitor.page.click('#sample');
  await visitor.until('finished');
  const whole = (await visitor.events('finished')).at(-1);
  for (const device of ['webgpu', 'cpu']) {
    await visitor.forget();
    await lose(visitor);
    await visitor.event('finding', 60_000);
    await visitor.until('finished');
    assert.equal((await visitor.events('ready')).at(-1).device, device);
    assert.equal((await losses(visitor)).length, 1);
    assert.deepEqual(await visitor.events('failed'), []);
    const { triangles } = (await visitor.events('finished')).at(-1);
    assert.ok(Math.abs(triangles / whole.triangles - 1) < 0.01, `${triangles} of ${whole.triangles} triangles`);
    assert.ok((await visitor.picture()).colours > 100, 'the room is in the picture');
  }
  await save(visitor, join(out, 'after.ply'));
  assert.deepEqual(await visitor.errors, []);
  await visitor.close();
});
