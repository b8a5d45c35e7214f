// Real rooms, where they lie beside the repository: dropped on the page, reconstructed, looked at and saved.
import assert from 'node:assert/strict';
import { copyFileSync, existsSync, mkdtempSync, readFileSync, rmSync } from 'node:fs';
import { tmpdir } from 'node:os';
import { join } from 'node:path';
import { after, before, test } from 'node:test';
import { root } from '../../tools/run.mjs';
import { chamfer, vertices } from './chamfer.mjs';
import { build, fuse, judge } from './command-line.mjs';
import { pictures, visit } from './launch.mjs';

const out = mkdtempSync(join(tmpdir(), 'ipdrecon-'));
let browser;
before(async () => {
  browser = await visit({ device: 'gpu' });
  await build();
});
after(async () => {
  rmSync(out, { recursive: true });
  await browser.close();
});

/** F at 5 cm that an independent fusion of the same keyframes reaches, less a hair; and how much browser and command line may differ. */
const least = {
  hololens: { plain: 0.95, transformerfusion: 0.97 },
  livingroom: { plain: 0.983, transformerfusion: 0.985 },
};
const F_SLACK = 0.005;
const CHAMFER_M = 0.001;

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
    const visitor = await browser.open({ traced: true });
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
    t.diagnostic(await visitor.isSmooth());
    assert.ok((await visitor.picture()).colours > 100, 'the room is in the picture');
    await page.screenshot({ path: join(pictures, `${name}.png`) });

    const download = await visitor.download('[data-format=ply]');
    const ply = join(out, `${name}.ply`);
    copyFileSync(await download.path(), ply);
    const header = readFileSync(ply).toString('latin1', 0, 2000);
    assert.equal(Number(/element face (\d+)/.exec(header)?.[1]), finished.triangles);
    await visitor.close();

    const own = join(out, `${name}-command-line.ply`);
    await fuse(path, own);
    const apart = chamfer(vertices(readFileSync(ply)), vertices(readFileSync(own)));
    t.diagnostic(`${name}: chamfer between browser and command line ${(apart * 1000).toFixed(4)} mm`);
    assert.ok(apart <= CHAMFER_M, `chamfer ${apart} m`);
    for (const [protocol, f] of Object.entries(least[name])) {
      const truth = join(path, '../gt.ply');
      const [page, line] = await Promise.all([ply, own].map((mesh) => judge(mesh, truth, protocol, path)));
      const [found, expected] = [page, line].map(({ surface }) => surface.f_score);
      t.diagnostic(`${name}, ${protocol}: F ${found.toFixed(4)} in the browser, ${expected.toFixed(4)} on the command line`);
      assert.ok(found >= f, `${protocol}: F ${found}, at least ${f} expected`);
      assert.ok(Math.abs(found - expected) <= F_SLACK, `${protocol}: F ${found} and ${expected}`);
    }
  });
}
