// The way a first visitor goes: the sample room, from the click to the file on the disk.
import assert from 'node:assert/strict';
import { readFileSync } from 'node:fs';
import { join } from 'node:path';
import { after, before, test } from 'node:test';
import validator from 'gltf-validator';
import { pictures, visit } from './launch.mjs';

let browser;
before(async () => {
  browser = await visit({ device: 'gpu' });
});
after(() => browser.close());

test('the sample becomes a mesh that can be looked at and saved', async () => {
  const visitor = await browser.open();
  const { page } = visitor;
  await page.getByRole('button', { name: 'Choose folder' }).waitFor();
  await page.getByRole('button', { name: 'Try the sample room' }).click();
  await visitor.until('finished');

  const [plan] = await visitor.events('planned');
  const [finished] = await visitor.events('finished');
  assert.equal(finished.cancelled, false);
  assert.equal(finished.frames, plan.plan.keyframes, 'every planned keyframe is fused');
  assert.ok(finished.triangles > 1000, `${finished.triangles} triangles`);
  const growth = (await visitor.events('bricks')).map(({ triangles }) => triangles);
  assert.ok(new Set(growth).size >= 3, `the mesh grows in steps: ${growth}`);
  const progress = await visitor.events('progress');
  assert.ok(progress.length > 3 && progress.every(({ done, total }) => done <= total));
  assert.match(await page.locator('#panel').innerText(), new RegExp(finished.triangles.toLocaleString('en-US')));

  const glb = readFileSync(await (await visitor.download('[data-format=glb]')).path());
  assert.equal(glb.toString('latin1', 0, 4), 'glTF');
  assert.equal(glb.readUInt32LE(8), glb.length, 'the length that the GLB states');
  const { issues } = await validator.validateBytes(new Uint8Array(glb));
  assert.deepEqual([issues.numErrors, issues.numWarnings], [0, 0], JSON.stringify(issues.messages));
  const { meshes } = JSON.parse(glb.toString('utf8', 20, 20 + glb.readUInt32LE(12)));
  assert.ok('COLOR_0' in meshes[0].primitives[0].attributes, 'vertex colours are kept');
  const ply = readFileSync(await (await visitor.download('[data-format=ply]')).path());
  assert.equal(Number(/element face (\d+)/.exec(ply.toString('latin1', 0, 2000))?.[1]), finished.triangles);
  const obj = readFileSync(await (await visitor.download('[data-format=obj]')).path(), 'utf8');
  assert.equal(obj.match(/^f /gm)?.length, finished.triangles);
  const canonical = page.getByLabel(/Canonical frame/);
  await canonical.check();
  const turned = readFileSync(await (await visitor.download('[data-format=ply]')).path());
  assert.equal(turned.length, ply.length, 'the canonical frame moves vertices and changes nothing else');

  const picture = await visitor.download('#screenshot');
  assert.equal(readFileSync(await picture.path()).toString('latin1', 1, 4), 'PNG');
  assert.deepEqual(visitor.errors, []);
  await visitor.close();
});

test('each shading is another picture, and so are the cameras and the view from above', async () => {
  const visitor = await browser.open({ path: '?sample' });
  const { page } = visitor;
  await visitor.until('finished');
  const seen = new Map();
  const look = async (name) => {
    // The camera eases to its place: the same picture twice says that it has come to rest.
    let last = await visitor.picture();
    for (let tries = 0; tries < 40; tries += 1) {
      await page.waitForTimeout(150);
      const now = await visitor.picture();
      if (now.hash === last.hash) break;
      last = now;
    }
    assert.ok(last.colours > 4, `${name}: ${last.colours} colours`);
    for (const [other, hash] of seen) assert.notEqual(last.hash, hash, `${name} looks like ${other}`);
    seen.set(name, last.hash);
  };
  await look('colour');
  for (const name of ['Normal', 'Wire', 'Depth', 'Views']) {
    await page.getByText(name, { exact: true }).click();
    await look(name);
    await page.screenshot({ path: join(pictures, `shading-${name}.png`) });
  }
  assert.match(await page.locator('#legend').innerText(), /Frames that measured it\s+1\s+2\s+4\s+8\s+16\s+32\+/);
  assert.ok(await page.getByRole('radio', { name: 'Confidence' }).isDisabled(), "a sensor's depth has no confidence");
  await page.getByText('Colour', { exact: true }).click();
  assert.ok(await page.locator('#legend').isHidden());
  await page.click('#cameras');
  await look('cameras');
  await page.click('#look-top');
  await look('from above');
  await page.click('#theme');
  await look('dark');
  await visitor.close();
});

test('a run can be held, goes on where it was, and can be stopped with what is there', async () => {
  const visitor = await browser.open({ path: '?sample' });
  const { page } = visitor;
  await visitor.event('progress');
  await page.getByRole('button', { name: 'Pause' }).click();
  await visitor.until('paused');
  const held = (await visitor.events('progress')).at(-1);
  await page.waitForTimeout(1500);
  const later = (await visitor.events('progress')).at(-1);
  assert.equal(later.done, held.done, 'nothing is fused while it is held');

  await page.getByRole('button', { name: 'Go on' }).click();
  await visitor.until('running');
  await page.waitForFunction((done) => window.record.events.some((event) => event.type === 'progress' && event.done > done), held.done);
  const next = (await visitor.events('progress')).find(({ done }) => done > held.done);
  assert.ok(next.elapsedS - held.elapsedS < 1.4, 'the pause does not count as work');

  await page.getByRole('button', { name: 'Cancel' }).click();
  await visitor.until('finished');
  const [finished] = await visitor.events('finished');
  assert.equal(finished.cancelled, true);
  assert.ok(finished.frames < (await visitor.events('planned'))[0].plan.keyframes);
  assert.equal(await page.locator('#panel-title').innerText(), 'Stopped');
  const glb = readFileSync(await (await visitor.download('[data-format=glb]')).path());
  assert.ok(finished.triangles > 0 && glb.length > 1000, 'what was fused so far can be saved');

  await page.getByRole('button', { name: 'New scan' }).click();
  await visitor.until('idle');
  assert.ok(await page.getByRole('button', { name: 'Choose folder' }).isVisible());
  await visitor.close();
});

test('with a review the plan waits, and its options change it', async () => {
  const visitor = await browser.open({ path: '?sample&autostart=0' });
  const { page } = visitor;
  await visitor.until('planned');
  const [{ plan }] = await visitor.events('planned');
  await page.waitForTimeout(500);
  assert.equal(await visitor.state(), 'planned', 'it waits');
  assert.match(await page.locator('#plan').innerText(), new RegExp(`${plan.keyframes} of ${plan.frames}`));
  assert.match(await page.locator('#plan').innerText(), /Expected time\s+about \d+ s/);
  assert.ok(plan.expectedS > 0 && plan.downloadBytes === undefined);

  await page.getByLabel('Voxel size').selectOption('8 cm');
  await page.getByLabel('Keyframes').selectOption('every 2nd');
  await page.waitForFunction(() => window.record.events.filter((event) => event.type === 'planned').length === 3);
  const changed = (await visitor.events('planned')).at(-1).plan;
  assert.ok(Math.abs(changed.options.voxelSizeM - 0.08) < 1e-6);
  assert.ok(changed.bricks < plan.bricks, `${changed.bricks} bricks of 8 cm, ${plan.bricks} of 4 cm`);
  assert.equal(changed.keyframes, Math.ceil(plan.keyframes / 2));

  await page.getByRole('button', { name: 'Start' }).click();
  await visitor.until('finished');
  assert.equal((await visitor.events('finished'))[0].frames, changed.keyframes);
  await visitor.close();
});
