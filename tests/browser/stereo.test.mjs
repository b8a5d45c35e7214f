// Photos without depth: the page says that it will estimate depth, matches the views, and the mesh is the command line's.
import assert from 'node:assert/strict';
import { existsSync, mkdtempSync, readFileSync, rmSync } from 'node:fs';
import { tmpdir } from 'node:os';
import { join } from 'node:path';
import { after, before, test } from 'node:test';
import { root } from '../../tools/run.mjs';
import { chamfer, vertices } from './chamfer.mjs';
import { build, fuse, judge, sampleFolder, stereo } from './command-line.mjs';
import { pictures, visit } from './launch.mjs';
import { choose, progressOf, save, stages, withoutDepth } from './photos.mjs';
import { put, scan } from './scene.mjs';

const out = mkdtempSync(join(tmpdir(), 'ipdrecon-'));
const CHAMFER_M = 0.001;
const LIMIT_BYTES = 600e6;
let browser;
before(async () => {
  browser = await visit();
});
after(async () => {
  rmSync(out, { recursive: true });
  await browser.close();
});

const panel = ({ page }) => page.locator('#panel').innerText();

test('a room without depth is planned, matched, looked at and saved', async (t) => {
  await build();
  const whole = join(out, 'sample-room');
  await sampleFolder(whole);
  const visitor = await browser.open({ path: '?autostart=0', traced: true });
  await visitor.until('idle');
  await visitor.forget();
  await visitor.drop(withoutDepth(whole, join(out, 'photos')));
  await visitor.until('planned');
  const [opened] = await visitor.events('opened');
  assert.deepEqual([opened.hasDepth, opened.hasColor], [false, true]);
  assert.equal((await visitor.events('planned')).at(-1).plan.depth, 'network', 'the network makes more of photos, unless told otherwise');
  await choose(visitor, { 'Depth from': 'stereo', 'Photos scaled to': '160 × 120', Keyframes: '60' });
  assert.match(await panel(visitor), /no depth images\. Depth is estimated from the photos/);
  const { plan } = (await visitor.events('planned')).at(-1);
  const started_ms = await visitor.page.evaluate(() => performance.now());
  await visitor.page.click('#run');
  await visitor.event('progress');
  assert.match(await panel(visitor), /Depth\s+estimated from photos/);
  assert.match(await panel(visitor), /without depth/);
  assert.match(await panel(visitor), /Photos scaled to\s+160 × 120/);
  await visitor.page.getByText(/^Matching views, \d+ of \d+$/).waitFor();
  await visitor.within(600_000, 'finished');

  assert.deepEqual(await stages(visitor), ['opening', 'warmingUp', 'matching', 'meshing']);
  const progress = await progressOf(visitor, 'matching');
  assert.ok(progress.every(({ total }) => total === plan.keyframes));
  assert.equal(progress.at(-1).done, plan.keyframes, 'every keyframe is matched');
  const [finished] = await visitor.events('finished');
  const [first] = (await visitor.events('bricks')).filter(({ triangles }) => triangles > 0);
  const seconds = ({ at_ms }) => (at_ms - started_ms) / 1000;
  t.diagnostic(`${plan.keyframes} keyframes: first surface after ${seconds(first).toFixed(1)} s, whole after ${seconds(finished).toFixed(1)} s, ${finished.frames} fused, heap ${(finished.heapBytes / 1e6).toFixed(0)} MB`);
  assert.ok(first.at_ms < progress.at(-1).at_ms, 'there is something to see before the last keyframe is matched');
  assert.ok(finished.heapBytes < LIMIT_BYTES, `${finished.heapBytes} bytes of heap`);
  t.diagnostic(await visitor.isSmooth());
  assert.deepEqual(visitor.errors, []);
  assert.ok((await visitor.picture()).colours > 100, 'the room is in the picture');

  const glb = readFileSync(await (await visitor.download('[data-format=glb]')).path());
  assert.equal(glb.toString('latin1', 0, 4), 'glTF');
  const ply = await save(visitor, join(out, 'sample-stereo.ply'));
  const sensor = join(out, 'sample-sensor.ply');
  await fuse(whole, sensor);
  const { surface } = await judge(ply, sensor, 'plain');
  t.diagnostic(`against the sensor's mesh: F at 5 cm ${surface.f_score.toFixed(3)}, precision ${surface.precision.toFixed(3)}, recall ${surface.recall.toFixed(3)}`);
  assert.ok(surface.precision > 0.7 && surface.recall > 0.3, 'it is the same room');
  await visitor.close();
});

for (const device of ['gpu', 'cpu']) {
  test(`a real scan, photos alone: in time, and as on the command line; device ${device}`, async (t) => {
    const path = join(root, '../shared/scans/hololens/scan');
    if (!existsSync(path)) {
      console.log('skipped: the real scan hololens is not beside the repository');
      t.skip('the real scans are not beside the repository');
      return;
    }
    await build();
    const photos = withoutDepth(path, join(out, `hololens-${device}`));
    const visitor = await browser.open({ path: `?autostart=0&device=${device}` });
    const { page } = visitor;
    await visitor.until('idle');
    await visitor.drop(photos);
    await visitor.until('planned');
    await choose(visitor, { 'Depth from': 'stereo', 'Photos scaled to': '160 × 120', Keyframes: '30' });
    const { plan } = (await visitor.events('planned')).at(-1);
    assert.equal(plan.keyframes, 30);
    assert.deepEqual(plan.options.stereoSize, { widthPx: 160, heightPx: 120 });
    await page.click('#run');
    await visitor.within(300_000, 'finished');
    const [finished] = await visitor.events('finished');
    t.diagnostic(`hololens on ${device}, 160x120, 30 views: ${finished.elapsedS.toFixed(1)} s, ${finished.frames} fused, ${finished.triangles} triangles, heap ${(finished.heapBytes / 1e6).toFixed(0)} MB`);
    assert.ok(finished.elapsedS < 240, `${finished.elapsedS} s, less than 4 minutes expected`);
    assert.ok((await visitor.picture()).colours > 100, 'the room is in the picture');
    await page.screenshot({ path: join(pictures, `hololens-stereo-${device}.png`) });
    const ply = await save(visitor, join(out, `hololens-stereo-${device}.ply`));
    await visitor.close();

    const own = join(out, `hololens-stereo-${device}-command-line.ply`);
    await stereo(photos, own, { views: 30, size: '160x120' });
    const apart = chamfer(vertices(readFileSync(ply)), vertices(readFileSync(own)));
    t.diagnostic(`hololens on ${device}: chamfer between browser and command line ${(apart * 1000).toFixed(4)} mm`);
    assert.ok(apart <= CHAMFER_M, `chamfer ${apart} m`);
  });
}

test('with depth and photos there is a choice, and the sensor comes first', async () => {
  const visitor = await browser.open({ path: '?sample&autostart=0' });
  const { page } = visitor;
  await visitor.until('planned');
  const source = page.getByLabel('Depth from');
  assert.equal((await visitor.events('planned')).at(-1).plan.depth, 'sensor');
  assert.ok(await source.isEnabled());
  assert.equal(await source.inputValue(), 'sensor');
  assert.ok(await page.getByLabel('Photos scaled to').isHidden(), 'photos are scaled for stereo alone');
  await choose(visitor, { 'Depth from': 'stereo', 'Photos scaled to': '160 × 120', Keyframes: '30' });
  await page.getByText('Depth is estimated from the photos, which takes longer').waitFor();
  await page.click('#run');
  await visitor.within(300_000, 'finished');
  const [finished] = await visitor.events('finished');
  assert.ok((await stages(visitor)).includes('matching'));
  assert.ok(finished.triangles > 1000, `${finished.triangles} triangles`);

  // And back: the next run takes the sensor's depth again.
  await source.selectOption('the sensor');
  await visitor.forget();
  await page.getByRole('button', { name: 'Run again' }).click();
  await visitor.until('running');
  await visitor.until('finished');
  assert.deepEqual(await stages(visitor), ['warmingUp', 'fusing', 'meshing']);
  await visitor.close();
});

for (const device of ['gpu', 'cpu']) {
  test(`matching can be held, goes on, and can be stopped with what is there; device ${device}`, async (t) => {
    const visitor = await browser.open({ path: `?sample&autostart=0&device=${device}` });
    const { page } = visitor;
    await visitor.until('planned');
    await choose(visitor, { 'Depth from': 'stereo', 'Photos scaled to': '160 × 120', Keyframes: '30' });
    await page.click('#run');
    await page.getByText(/^Matching views, \d+ of \d+$/).waitFor({ timeout: 60_000 });
    const asked_ms = await page.evaluate(() => performance.now());
    await page.getByRole('button', { name: 'Pause' }).click();
    await visitor.until('paused');
    const { at_ms: paused_ms } = await visitor.event('paused');
    const held = (await progressOf(visitor, 'matching')).at(-1);
    await page.waitForTimeout(3000);
    assert.equal((await progressOf(visitor, 'matching')).at(-1).done, held.done, 'nothing is matched while it is held');
    assert.match(await panel(visitor), /Paused/);

    await page.getByRole('button', { name: 'Go on' }).click();
    await page.waitForFunction((done) => window.record.events.some(({ type, done: now }) => type === 'progress' && now > done), held.done, { timeout: 60_000 });
    const next = (await progressOf(visitor, 'matching')).find(({ done }) => done > held.done);
    assert.ok(next.elapsedS - held.elapsedS < (next.at_ms - held.at_ms) / 1000 - 2.5, 'the pause does not count as work');
    await page.waitForFunction(() => window.record.events.some(({ type, triangles }) => type === 'bricks' && triangles > 0), null, { timeout: 240_000 });

    await page.getByRole('button', { name: 'Cancel' }).click();
    await visitor.until('finished');
    const [finished] = await visitor.events('finished');
    assert.equal(finished.cancelled, true);
    assert.ok(finished.frames > 0 && finished.frames < (await visitor.events('planned')).at(-1).plan.keyframes);
    assert.equal(await page.locator('#panel-title').innerText(), 'Stopped');
    const glb = readFileSync(await (await visitor.download('[data-format=glb]')).path());
    assert.ok(finished.triangles > 0 && glb.length > 1000, 'what was matched so far can be saved');
    t.diagnostic(`held ${(paused_ms - asked_ms).toFixed(0)} ms after the click`);
    await visitor.close();
  });
}

for (const device of ['gpu', 'auto']) test(`the view can be turned while views are matched; device ${device}`, async (t) => {
  const visitor = await browser.open({ path: `?sample&autostart=0&device=${device}`, traced: true });
  const { page } = visitor;
  await visitor.until('planned');
  await choose(visitor, { 'Depth from': 'stereo', 'Photos scaled to': '160 × 120', Keyframes: '30' });
  await page.click('#run');
  await page.waitForFunction(() => window.record.events.some(({ type, triangles }) => type === 'bricks' && triangles > 0), null, { timeout: 240_000 });
  await visitor.forget();
  const { x, y, width, height } = await page.locator('ipd-recon').boundingBox();
  const waits_ms = [];
  for (let turn = 0; turn < 4; turn += 1) {
    await page.mouse.move(x + width / 2, y + height / 2);
    await page.mouse.down();
    await page.mouse.move(x + width / 2 + 60, y + height / 2 + 10, { steps: 4 });
    await page.mouse.up();
    const let_go_ms = await page.evaluate(() => performance.now());
    await page.waitForFunction((turns) => window.record.events.filter(({ type }) => type === 'cameraChanged').length > turns, turn, { timeout: 60_000 });
    waits_ms.push((await visitor.events('cameraChanged'))[turn].at_ms - let_go_ms);
  }
  assert.equal((await visitor.events('finished')).length, 0, 'the view has moved and come to rest before the run was over');
  t.diagnostic(`the view came to rest ${waits_ms.map((ms) => ms.toFixed(0)).join(', ')} ms after the pointer let go`);
  t.diagnostic(await visitor.isSmooth());
  await page.click('#cancel');
  await visitor.until('finished');
  await visitor.close();
});

test('photos that were all taken from one spot: stereo refuses them with the reason, the network warns', async (t) => {
  const files = Object.fromEntries(Object.entries(scan(12)).filter(([path]) => !path.endsWith('.depth.png')));
  const visitor = await browser.open({ path: '?autostart=0' });
  await visitor.until('idle');
  await visitor.drop(put(join(out, 'spot'), files));
  await visitor.until('planned');
  await choose(visitor, { 'Depth from': 'stereo' });
  await visitor.page.click('#run');
  await visitor.until('failed');
  const [failed] = await visitor.events('failed');
  assert.equal(failed.code, 'scan');
  assert.match(failed.message, /places at least [\d.]+ m apart/);
  assert.match(failed.advice, /walk sideways/);
  await visitor.page.getByRole('button', { name: 'Back to the start' }).click();
  await visitor.until('idle');

  await visitor.forget();
  await visitor.drop(join(out, 'spot'));
  await visitor.until('planned');
  await choose(visitor, { 'Depth from': 'the network' });
  await visitor.page.click('#run');
  await visitor.until('finished');
  const warned = (await visitor.events('finding')).find(({ finding }) => finding.code === 'no-guide');
  assert.match(warned.finding.advice, /Walk sideways/);
  t.diagnostic(`the network: ${(await visitor.events('finished'))[0].triangles} triangles`);
  await visitor.close();
});

test('with depth images alone there is no choice, and the page says why', async () => {
  const files = Object.fromEntries(Object.entries(scan(12)).filter(([path]) => !path.endsWith('.color.png')));
  const visitor = await browser.open({ path: '?autostart=0' });
  await visitor.until('idle');
  await visitor.drop(put(join(out, 'depth-alone'), files));
  await visitor.until('planned');
  assert.equal((await visitor.events('planned')).at(-1).plan.depth, 'sensor');
  assert.ok(await visitor.page.getByLabel('Depth from').isDisabled());
  assert.match(await panel(visitor), /no photos to estimate depth from/);
  await visitor.close();
});
