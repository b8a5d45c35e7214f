// Photos without depth, by the network: fetched, planned, streamed from coarse to fine, and the mesh is the command line's.
import assert from 'node:assert/strict';
import { existsSync, mkdtempSync, readFileSync, rmSync, writeFileSync } from 'node:fs';
import { tmpdir } from 'node:os';
import { join } from 'node:path';
import { after, before, test } from 'node:test';
import { root } from '../../tools/run.mjs';
import { chamfer, vertices } from './chamfer.mjs';
import { build, fuse, judge, reconstruct, sampleFolder } from './command-line.mjs';
import { pictures, visit } from './launch.mjs';
import { choose, save, stages, withoutDepth } from './photos.mjs';

const out = mkdtempSync(join(tmpdir(), 'ipdrecon-'));
const CHAMFER_M = 0.001;
const SAME_F = 0.005;
const STAGES = ['opening', 'downloading', 'warmingUp', 'features', 'matching', 'coarse', 'medium', 'fine', 'coloring', 'meshing'];
const WEIGHTS = '**/ipdrecon.safetensors';
const released = join(root, 'weights/ipdrecon.safetensors');
let browser;
let photos;
before(async () => {
  browser = await visit();
  await build();
  await sampleFolder(join(out, 'sample-room'));
  photos = withoutDepth(join(out, 'sample-room'), join(out, 'photos'));
});
after(async () => {
  rmSync(out, { recursive: true });
  await browser.close();
});

// `gpu` has a software adapter do everything, which is slower than what it is given by itself (`auto`); on a real one they are the same.
for (const [device, FIRST_S, WHOLE_S] of [['auto', 60, 360], ['cpu', 120, 600], ['gpu', 180, 360]]) {
  test(`a real scan, photos alone: in time, coarse first, and as on the command line; device ${device}`, async (t) => {
    const path = join(root, '../shared/scans/hololens/scan');
    if (!existsSync(path)) {
      console.log('skipped: the real scan hololens is not beside the repository');
      t.skip('the real scans are not beside the repository');
      return;
    }
    const scan = withoutDepth(path, join(out, `hololens-${device}`));
    const visitor = await browser.open({ path: `?autostart=0&device=${device}`, traced: true });
    const { page } = visitor;
    await visitor.until('idle');
    await visitor.drop(scan);
    await visitor.until('planned');
    await choose(visitor, { Keyframes: '20' });
    const { plan } = (await visitor.events('planned')).at(-1);
    assert.deepEqual([plan.depth, plan.options.preset, plan.keyframes], ['network', 'small', 20]);
    const started_ms = await page.evaluate(() => performance.now());
    await page.click('#run');
    await visitor.event('bricks', 1000 * FIRST_S + 60_000);
    await page.screenshot({ path: join(pictures, `hololens-network-coarse-${device}.png`) });
    await visitor.within(1000 * WHOLE_S + 60_000, 'finished');
    const [finished] = await visitor.events('finished');
    const [first] = (await visitor.events('bricks')).filter(({ triangles }) => triangles > 0);
    const seconds = ({ at_ms }) => (at_ms - started_ms) / 1000;
    const began = (await visitor.events('stage')).filter(({ at_ms }) => at_ms > started_ms);
    t.diagnostic(`hololens on ${device}, 20 views: first surface after ${seconds(first).toFixed(1)} s, whole after ${seconds(finished).toFixed(1)} s, heap ${(finished.heapBytes / 1e6).toFixed(0)} MB; stages began at ${began.map((event) => `${event.stage} ${seconds(event).toFixed(1)}`).join(', ')}`);
    assert.deepEqual(await stages(visitor), STAGES);
    assert.ok(seconds(first) < FIRST_S, 'first surface in time');
    assert.ok(seconds(finished) < WHOLE_S, 'whole in time');
    t.diagnostic(await visitor.isSmooth());
    assert.deepEqual(visitor.errors, []);
    assert.ok((await visitor.picture()).colours > 100, 'the room is in the picture');
    await page.screenshot({ path: join(pictures, `hololens-network-${device}.png`) });
    const ply = await save(visitor, join(out, `hololens-network-${device}.ply`));
    await visitor.close();

    const own = join(out, `hololens-network-${device}-command-line.ply`);
    await reconstruct(scan, own, { keyframes: 20 });
    const apart = chamfer(vertices(readFileSync(ply)), vertices(readFileSync(own)));
    const truth = join(root, '../shared/scans/hololens/gt.ply');
    const f = [];
    for (const mesh of [ply, own]) f.push((await judge(mesh, truth, 'transformerfusion', path)).surface.f_score);
    t.diagnostic(`hololens on ${device}: chamfer between browser and command line ${(apart * 1000).toFixed(4)} mm, F ${f.map((f) => f.toFixed(4)).join(' and ')}`);
    assert.ok(apart <= CHAMFER_M, `chamfer ${apart} m`);
    assert.ok(Math.abs(f[0] - f[1]) <= SAME_F, `F ${f}`);
  });
}

test('the network and its guide on WebGPU itself, even where that is software, make the room of the command line', async (t) => {
  const visitor = await planned({ path: '?autostart=0&device=gpu' });
  const [ready] = await visitor.events('ready');
  assert.equal(ready.device, 'webgpu');
  const { failed, finished } = await run(visitor, 8);
  assert.equal(failed, undefined);
  const ply = await save(visitor, join(out, 'gpu.ply'));
  assert.deepEqual(visitor.errors, []);
  await visitor.close();
  const own = join(out, 'gpu-command-line.ply');
  await reconstruct(photos, own, { keyframes: 8 });
  const apart = chamfer(vertices(readFileSync(ply)), vertices(readFileSync(own)));
  const sensor = join(out, 'sample-sensor.ply');
  await fuse(join(out, 'sample-room'), sensor);
  const f = [];
  for (const mesh of [ply, own]) f.push((await judge(mesh, sensor, 'plain')).surface.f_score);
  t.diagnostic(`sample room on ${ready.adapter}, 8 views: ${finished.elapsedS.toFixed(1)} s; chamfer to the command line on the processor ${(apart * 1000).toFixed(4)} mm, F ${f.map((f) => f.toFixed(4)).join(' and ')}`);
  assert.ok(apart <= CHAMFER_M, `chamfer ${apart} m`);
  assert.ok(Math.abs(f[0] - f[1]) <= SAME_F, `F ${f}`);
});

/** A page with the photos of the sample room, or others, planned; what it asks of the site on the way is counted. */
async function planned({ scan = photos, ...options } = {}) {
  const visitor = await browser.open({ path: '?autostart=0&device=cpu', ...options });
  await visitor.until('idle');
  await visitor.drop(scan);
  await visitor.until('planned');
  return visitor;
}

/** Runs few views, and says how that ended: the run's own end or why it failed. */
const run = ({ page }, views = 8) => page.evaluate(async (views) => {
  const viewer = document.querySelector('ipd-recon');
  return viewer.run({ views }).then((finished) => ({ finished }), ({ code, message, advice }) => ({ failed: { code, message, advice } }));
}, views);

test('the network is fetched once: a second visit downloads nothing', async () => {
  let asked = 0;
  const visitor = await planned({ before: (page) => page.context().route(WEIGHTS, (route) => { asked += 1; return route.continue(); }) });
  const { page } = visitor;
  const plan = async () => (await visitor.events('planned')).at(-1).plan;
  assert.equal((await plan()).downloadBytes, readFileSync(released).length, 'told before it is fetched');
  assert.match(await page.locator('#plan').innerText(), /Download\s+5 MB of weights, once\s+Expected time\s+about .*The processor does the work, with 160 × 120, 20 views, in about \d/s);
  const first = await run(visitor);
  assert.ok(first.finished?.triangles > 0, JSON.stringify(first));
  const progress = (await visitor.events('progress')).filter(({ total }) => total > 1e6);
  assert.equal(progress.at(-1)?.done, readFileSync(released).length, 'told in bytes, to the last');
  await page.reload();
  await visitor.until('idle');
  await visitor.drop(photos);
  await visitor.until('planned');
  assert.equal((await plan()).downloadBytes, 0, 'kept');
  const second = await run(visitor);
  assert.equal(second.finished?.triangles, first.finished.triangles, 'the same network');
  assert.equal(asked, 1);
  assert.deepEqual((await visitor.events('finding')).filter(({ finding }) => finding.code === 'weights'), []);
  await visitor.close();
});

test('how sure the network is and how many views there were are pictures of their own, with a legend', async () => {
  const visitor = await planned();
  const { page } = visitor;
  assert.ok((await run(visitor)).finished?.triangles > 0);
  const hashes = new Set();
  for (const [name, words] of [['Colour', null], ['Confidence', /Confidence of the network.*\s0\s+0\.5\s+1\s/], ['Views', /Views that have it in the picture\s+1\s+2\s.*not known/s]]) {
    await page.getByText(name, { exact: true }).click();
    await page.waitForTimeout(1000);
    const picture = await visitor.picture();
    assert.ok(picture.colours > 30, `${name}: ${picture.colours} colours`);
    hashes.add(picture.hash);
    if (words) assert.match(await page.locator('#legend').innerText(), words);
    await page.screenshot({ path: join(pictures, `network-${name}.png`) });
  }
  assert.equal(hashes.size, 3);
  await visitor.close();
});

test('the view answers the hand while the network works', async (t) => {
  const real = join(root, '../shared/scans/hololens/scan');
  const scan = existsSync(real) ? withoutDepth(real, join(out, 'hololens-dragged')) : photos;
  const visitor = await planned({ path: '?autostart=0', scan, traced: true });
  const { page } = visitor;
  const [worker] = page.workers();
  // The viewer's own frames: when each was drawn, in the worker.
  await worker.evaluate(() => {
    self.framesAt_ms = [];
    const ask = self.requestAnimationFrame.bind(self);
    self.requestAnimationFrame = (draw) => ask((time) => {
      draw(time);
      self.framesAt_ms.push(performance.timeOrigin + performance.now());
    });
  });
  const { x, y, width, height } = await page.locator('ipd-recon').boundingBox();
  /** Drags for so long, or while the state is this, and says how long it took from one frame to the next. */
  const drag = async (limit_ms, state) => {
    const [left, top, start_ms] = [x + width / 2, y + height / 2, Date.now()];
    await page.mouse.move(left, top);
    await page.mouse.down();
    while (Date.now() - start_ms < limit_ms && (await visitor.state()) === state) {
      const turn = (Date.now() - start_ms) / 1000;
      await page.mouse.move(left + 200 * Math.sin(turn), top + 40 * Math.sin(2 * turn));
      await page.waitForTimeout(12);
    }
    await page.mouse.up();
    const all = await worker.evaluate(() => self.framesAt_ms);
    const times = all.filter((at_ms) => at_ms >= start_ms && at_ms <= Date.now());
    const gaps = times.slice(1).map((at_ms, index) => at_ms - times[index]).sort((a, b) => a - b);
    assert.ok(gaps.length >= 10, `${gaps.length} frames while the view was dragged`);
    const part = (share) => gaps[Math.min(gaps.length - 1, Math.floor(gaps.length * share))];
    return { median: part(0.5), p95: part(0.95), longest: gaps.at(-1) };
  };
  const ended = run(visitor, 12);
  await visitor.event('bricks', 120_000);
  await visitor.forgetTasks();
  const busy = await drag(240_000, 'running');
  assert.ok((await ended).finished?.triangles > 0);
  t.diagnostic(await visitor.isSmooth());
  await page.waitForTimeout(1000);
  const idle = await drag(6000, 'finished');
  const words = ({ median, p95, longest }) => `median ${median.toFixed(0)}, 95 % ${p95.toFixed(0)}, longest ${longest.toFixed(0)} ms`;
  t.diagnostic(`from frame to frame under the hand: ${words(busy)} while the network works, ${words(idle)} when it is done`);
  assert.ok(busy.p95 <= 3 * idle.p95, '95 % of the frames come as fast as ever');
  await visitor.close();
});

for (const [what, answer, words] of [
  ['absent', (route) => route.fulfill({ status: 404, body: 'not here' }), /found the answer 404/],
  ['out of reach', (route) => route.abort(), /Expected the network's weights at .*ipdrecon.safetensors/],
  ['damaged on their way', (route) => route.fulfill({ body: readFileSync(released).fill(7, 1_000_000, 1_000_010) }), /the hash .*, found 4\d{6} bytes with/],
  ['cut short', (route) => route.fulfill({ body: readFileSync(released).subarray(0, 1_000_000) }), /found 1000000 bytes with/],
]) {
  test(`weights that are ${what} are told of, and the visitor goes on`, async () => {
    let faulty = true;
    const visitor = await planned({ before: (page) => page.context().route(WEIGHTS, (route) => (faulty ? answer(route) : route.continue())) });
    const { failed } = await run(visitor);
    assert.equal(failed?.code, 'weights');
    assert.match(failed.message, words);
    assert.match(failed.advice, /start again|estimate depth from the photos alone/);
    assert.deepEqual(visitor.errors, []);
    faulty = false;
    assert.ok((await run(visitor)).finished?.triangles > 0, 'the same engine goes on once they are there');
    await visitor.close();
  });
}

test('weights of the visitor are taken by drop; what is no such file is refused in words', async () => {
  let asked = 0;
  const visitor = await planned({ before: (page) => page.context().route(WEIGHTS, (route) => { asked += 1; return route.continue(); }) });
  const cut = join(out, 'cut.safetensors');
  writeFileSync(cut, readFileSync(released).subarray(0, 2_000_000));
  await visitor.drop(cut);
  const failed = await visitor.event('failed');
  assert.equal(failed.code, 'weights');
  assert.match(`${failed.message} ${failed.advice}`, /found 2000000 bytes that are none.*cut short/);
  await visitor.drop(released);
  const weights = await visitor.event('weights');
  assert.deepEqual([weights.name, weights.bytes], ['ipdrecon.safetensors', readFileSync(released).length]);
  assert.ok((await run(visitor)).finished?.triangles > 0);
  assert.equal(asked, 0, 'nothing was fetched');
  await visitor.close();
});

test('a hidden page holds its run until it is seen again', async () => {
  const visitor = await planned();
  const { page } = visitor;
  const turn = (hidden) => page.evaluate((hidden) => {
    Object.defineProperty(document, 'hidden', { value: hidden, configurable: true });
    document.dispatchEvent(new Event('visibilitychange'));
  }, hidden);
  const ended = run(visitor);
  await visitor.until('running');
  await turn(true);
  await visitor.until('paused');
  await turn(false);
  assert.ok((await ended).finished?.triangles > 0);
  await visitor.close();
});

test('a run is held, goes on, and is stopped at any stage; ten runs leave no more memory than one', async (t) => {
  const visitor = await planned();
  const { page } = visitor;
  const heaps = [];
  for (let i = 0; i < 10; i += 1) {
    const stop = { 3: 'features', 5: 'matching', 7: 'medium' }[i];
    if (stop === undefined) {
      heaps.push((await run(visitor)).finished.heapBytes);
      continue;
    }
    await visitor.forget();
    const ended = run(visitor);
    await page.waitForFunction((stage) => window.record.events.some((event) => event.stage === stage), stop, { polling: 10, timeout: 120_000 });
    await page.evaluate(() => document.querySelector('ipd-recon').pause());
    await visitor.until('paused');
    await page.evaluate(() => document.querySelector('ipd-recon').resume());
    await visitor.until('running');
    await page.evaluate(() => document.querySelector('ipd-recon').cancel());
    const { finished } = await ended;
    assert.equal(finished.cancelled, true, `stopped at ${stop}`);
    heaps.push(finished.heapBytes);
  }
  t.diagnostic(`heap after each of ten runs, the 4th, 6th and 8th stopped: ${heaps.map((bytes) => (bytes / 1e6).toFixed(0)).join(', ')} MB`);
  assert.ok(heaps.at(-1) <= 1.05 * heaps[0], `${heaps}`);
  assert.deepEqual(visitor.errors, []);
  await visitor.close();
});
