// Real rooms, where they lie beside the repository: dropped on the page, reconstructed, looked at and saved.
import assert from 'node:assert/strict';
import { copyFileSync, existsSync, mkdtempSync, readFileSync, rmSync } from 'node:fs';
import { tmpdir } from 'node:os';
import { join } from 'node:path';
import { after, before, test } from 'node:test';
import { root } from '../../tools/run.mjs';
import { pictures, visit } from './launch.mjs';

const out = mkdtempSync(join(tmpdir(), 'ipdrecon-'));
let browser;
before(async () => {
  browser = await visit();
});
after(async () => {
  rmSync(out, { recursive: true });
  await browser.close();
});

const scans = [
  // A true drop for the one, the folder button's input for the other.
  { name: 'hololens', frames: 100, limit_s: 90, open: (visitor, path) => visitor.drop(path) },
  { name: 'livingroom', frames: 33, limit_s: 90, open: (visitor, path) => visitor.page.setInputFiles('#folder-input', path) },
];

for (const { name, frames, limit_s, open } of scans) {
  test(name, async (t) => {
    const path = join(root, '../shared/scans', name, 'scan');
    if (!existsSync(path)) {
      console.log(`skipped: ${name}, the real scans are not beside the repository`);
      t.skip('the real scans are not beside the repository');
      return;
    }
    const visitor = await browser.open();
    const { page } = visitor;
    await visitor.until('idle');
    await visitor.forget();
    const dropped_ms = await page.evaluate(() => performance.now());
    await open(visitor, path);
    await visitor.until('finished');
    const [opened] = await visitor.events('opened');
    const [finished] = await visitor.events('finished');
    const [brick] = (await visitor.events('bricks')).filter(({ triangles }) => triangles > 0);
    const seconds = (event) => (event.at_ms - dropped_ms) / 1000;
    t.diagnostic(`${name}: first brick after ${seconds(brick).toFixed(1)} s, whole after ${seconds(finished).toFixed(1)} s, ${finished.triangles} triangles, heap ${(finished.heapBytes / 1e6).toFixed(0)} MB`);
    assert.equal(opened.frames, frames);
    assert.equal(opened.format, '7-Scenes');
    assert.ok(seconds(brick) < 10, `first brick after ${seconds(brick)} s`);
    assert.ok(seconds(finished) < limit_s, `whole after ${seconds(finished)} s`);
    assert.deepEqual(await visitor.longTasks(), []);
    assert.ok((await visitor.picture()).colours > 100, 'the room is in the picture');
    await page.screenshot({ path: join(pictures, `${name}.png`) });

    const download = await visitor.download('[data-format=ply]');
    const ply = join(out, `${name}.ply`);
    copyFileSync(await download.path(), ply);
    const header = readFileSync(ply).toString('latin1', 0, 2000);
    assert.equal(Number(/element face (\d+)/.exec(header)?.[1]), finished.triangles);
    await visitor.close();
  });
}
