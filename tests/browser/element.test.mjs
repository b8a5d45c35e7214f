// The npm package in pages that are not ours: the element in a bare page, and the pieces under it.
import assert from 'node:assert/strict';
import { mkdtempSync, rmSync } from 'node:fs';
import { tmpdir } from 'node:os';
import { join } from 'node:path';
import { after, before, test } from 'node:test';
import { visit } from './launch.mjs';
import { put, scan } from './scene.mjs';

const bare = (body) => `<!doctype html><html lang="en"><title>bare</title><style>ipd-recon { height: 400px }</style>
  <script type="module" src="/ipdrecon/index.js"></script><body style="height: 3000px">${body}`;
const folder = mkdtempSync(join(tmpdir(), 'ipdrecon-'));
let browser;
before(async () => {
  browser = await visit();
});
after(async () => {
  rmSync(folder, { recursive: true });
  await browser.close();
});

const open = (body) => browser.open({
  path: 'bare.html',
  before: (page) => page.route('**/bare.html', (route) => route.fulfill({ contentType: 'text/html', body: bare(body) })),
});

test('a folder dropped on the element becomes a mesh, with the options of its attributes', async () => {
  const visitor = await open('<ipd-recon voxel-size="0.08" every="2" shading="normal"></ipd-recon>');
  await visitor.until('idle');
  await visitor.drop(put(join(folder, 'box'), scan(12)), 'ipd-recon');
  await visitor.until('finished');
  const { plan } = (await visitor.events('planned')).at(-1);
  assert.ok(Math.abs(plan.options.voxelSizeM - 0.08) < 1e-6);
  assert.equal(plan.keyframes, 6);
  assert.equal((await visitor.events('finished'))[0].frames, 6);
  const bytes = await visitor.page.evaluate(async () => (await document.querySelector('ipd-recon').exportMesh('ply')).size);
  assert.ok(bytes > 1000);
  await visitor.close();
});

test('attributes choose stereo, its size and its views', async () => {
  const visitor = await open('<ipd-recon review depth="stereo" views="6" stereo-size="160x120"></ipd-recon>');
  const { page } = visitor;
  await visitor.until('idle');
  const plans = await page.evaluate(async () => {
    const element = document.querySelector('ipd-recon');
    const asked = await element.openSample();
    return [asked, await element.replan({ depth: 'sensor', views: undefined })];
  });
  assert.deepEqual(plans.map(({ depth }) => depth), ['stereo', 'sensor']);
  assert.deepEqual(plans[0].options.stereoSize, { widthPx: 160, heightPx: 120 });
  assert.equal(plans[0].keyframes, 6);
  assert.ok(plans[1].keyframes > 6, 'the sensor is asked for every keyframe');
  const status = () => page.evaluate(() => document.querySelector('ipd-recon').shadowRoot.querySelector('[role=status]').textContent);
  assert.doesNotMatch(await status(), /estimated/);
  await page.evaluate(() => document.querySelector('ipd-recon').replan());
  assert.match(await status(), /depth will be estimated from the photos/);
  await visitor.close();
});

test('an idle element leaves wheel and keys to the page', async () => {
  const visitor = await open('<ipd-recon></ipd-recon>');
  const { page } = visitor;
  await visitor.until('idle');
  await page.mouse.move(300, 200);
  await page.mouse.wheel(0, 300);
  await page.waitForFunction(() => scrollY > 0);
  await page.evaluate(() => scrollTo(0, 0));
  await page.evaluate(() => document.querySelector('ipd-recon').openSample());
  await visitor.until('finished');
  await page.mouse.wheel(0, 300);
  await visitor.event('cameraChanged');
  assert.equal(await page.evaluate(() => scrollY), 0, 'a room is zoomed instead');
  await visitor.close();
});

test('it can be taken out and put in again, and two can live in a page', async () => {
  const visitor = await open('<ipd-recon></ipd-recon>');
  const { page } = visitor;
  await visitor.until('idle');
  await page.evaluate(() => {
    const element = document.querySelector('ipd-recon');
    element.remove();
    document.body.prepend(element);
  });
  await visitor.until('idle');
  await page.evaluate(async () => {
    const { defineIpdRecon } = await import('/ipdrecon/index.js');
    defineIpdRecon('ipd-recon-two');
    document.body.append(document.createElement('ipd-recon-two'));
  });
  await page.waitForFunction(() => document.querySelector('ipd-recon-two').state === 'idle');
  const triangles = await page.evaluate(async () => {
    const run = async (element) => {
      await element.openSample(1, { autostart: false });
      return (await element.run({ voxelSizeM: 0.08 })).triangles;
    };
    return Promise.all([run(document.querySelector('ipd-recon')), run(document.querySelector('ipd-recon-two'))]);
  });
  assert.ok(triangles[0] > 100);
  assert.equal(triangles[0], triangles[1], 'the same room twice');
  assert.deepEqual(visitor.errors, []);
  await visitor.close();
});

test('the client works without an element and without a canvas', async () => {
  const visitor = await open('');
  const told = await visitor.page.evaluate(async () => {
    const { Reconstructor } = await import('/ipdrecon/index.js');
    const client = new Reconstructor();
    const states = [];
    client.addEventListener('state', ({ detail }) => states.push(detail));
    await client.ready;
    const early = await client.run().catch((error) => error.code);
    const plan = await client.openSample(2);
    const finished = await client.run({ voxelSizeM: 0.08 });
    const glb = await client.exportMesh('glb');
    const pending = client.exportMesh('obj').catch((error) => error.code);
    client.dispose();
    return { states, early, plan, finished, glb: [glb.name, glb.type, glb.size], disposed: await pending };
  });
  assert.deepEqual(told.states, ['idle', 'opening', 'planned', 'running', 'finished']);
  assert.equal(told.early, 'scan');
  assert.equal(told.disposed, 'disposed');
  assert.equal(told.finished.frames, told.plan.keyframes);
  assert.match(told.glb[0], /\.glb$/);
  assert.equal(told.glb[1], 'model/gltf-binary');
  await visitor.close();
});

test('whatever the browser cannot read is named, and the rest is taken', async () => {
  const visitor = await open('');
  const told = await visitor.page.evaluate(async () => {
    const { collect } = await import('/ipdrecon/index.js');
    const file = (fullPath, error) => ({
      isFile: true,
      fullPath,
      file: (resolve, reject) => (error ? reject(new DOMException(error, 'NotReadableError')) : resolve(new File(['x'], fullPath))),
    });
    const folder = (fullPath, parts) => ({
      isFile: false,
      fullPath,
      createReader: () => ({ readEntries: (resolve, reject) => (parts === null ? reject(new DOMException('locked', 'SecurityError')) : resolve(parts.shift() ?? [])) }),
    });
    const many = Array.from({ length: 250 }, (_, index) => file(`/scan/${index}.txt`));
    const scan = folder('/scan', [many.slice(0, 100), many.slice(100, 200), many.slice(200), [file('/scan/bad.png', 'gone'), folder('/scan/shut', null), file('/scan/.DS_Store')]]);
    const all = await collect([scan]);
    const none = await collect([folder('/empty', [])]).catch((error) => [error.name, error.message]);
    const unread = await collect([file('/a.png', 'gone')]).catch((error) => [error.name, error.message, error.unreadable]);
    return { name: all.name, paths: all.paths, files: all.files.length, unreadable: all.unreadable, none, unread };
  });
  assert.equal(told.name, 'scan');
  assert.equal(told.files, 250);
  assert.deepEqual(told.paths, [...told.paths].sort());
  assert.deepEqual(told.unreadable, [{ path: 'scan/bad.png', reason: 'gone' }, { path: 'scan/shut', reason: 'locked' }]);
  assert.deepEqual(told.none, ['DropError', '“empty” is empty.']);
  assert.deepEqual(told.unread, ['DropError', 'The browser could not read “a.png” (gone).', [{ path: 'a.png', reason: 'gone' }]]);
  await visitor.close();
});
