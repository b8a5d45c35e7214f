// A long scan must not fill the engine's memory: pictures are decoded one at a time and never kept.
import assert from 'node:assert/strict';
import { copyFileSync, existsSync, mkdtempSync, readdirSync, rmSync } from 'node:fs';
import { tmpdir } from 'node:os';
import { join } from 'node:path';
import { test } from 'node:test';
import { root } from '../../tools/run.mjs';
import { visit } from './launch.mjs';

const FRAMES = 1000;
const LIMIT_BYTES = 600e6;
const scan = join(root, '../shared/scans/hololens/scan');

/** The scan again and again, under numbers that go on. */
function repeat(folder) {
  const frames = readdirSync(scan).filter((name) => name.endsWith('.pose.txt')).sort();
  copyFileSync(join(scan, 'camera-intrinsics.txt'), join(folder, 'camera-intrinsics.txt'));
  for (let i = 0; i < FRAMES; i++) {
    const from = frames[i % frames.length].replace('.pose.txt', '');
    const to = `frame-${String(i).padStart(6, '0')}`;
    for (const ending of ['.color.jpg', '.depth.png', '.pose.txt']) copyFileSync(join(scan, from + ending), join(folder, to + ending));
  }
}

test('1,000 frames leave the engine as small as 500 did', async (t) => {
  if (!existsSync(scan)) {
    console.log('skipped: the real scan hololens is not beside the repository');
    t.skip('the real scans are not beside the repository');
    return;
  }
  const folder = mkdtempSync(join(tmpdir(), 'ipdrecon-'));
  const browser = await visit({ device: 'gpu' });
  t.after(async () => {
    await browser.close();
    rmSync(folder, { recursive: true });
  });
  repeat(folder);
  const visitor = await browser.open();
  await visitor.until('idle');
  await visitor.drop(folder);
  await visitor.until('finished');
  const [finished] = await visitor.events('finished');
  assert.equal(finished.frames, FRAMES);
  const fusing = (await visitor.events('progress')).filter(({ total }) => total === FRAMES);
  const heap = (done) => fusing.find((event) => event.done === done).heapBytes;
  t.diagnostic(`heap: ${[100, 500, 1000].map((done) => `${(heap(done) / 1e6).toFixed(1)} MB after ${done}`).join(', ')}; ${finished.elapsedS.toFixed(0)} s in all`);
  assert.ok(heap(FRAMES) < LIMIT_BYTES, `${heap(FRAMES)} bytes`);
  assert.ok(heap(FRAMES) <= heap(FRAMES / 2), `grew from ${heap(FRAMES / 2)} to ${heap(FRAMES)} bytes`);
  await visitor.close();
});
