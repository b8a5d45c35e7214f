// Bad input: whatever is wrong with a scan, the page names the file, what was expected, what was found and what to do; frames
// that are sound go on.
import assert from 'node:assert/strict';
import { mkdtempSync, rmSync } from 'node:fs';
import { tmpdir } from 'node:os';
import { join } from 'node:path';
import { after, before, test } from 'node:test';
import { visit } from './launch.mjs';
import { depthPng, put, scan, zip } from './scene.mjs';

const folder = mkdtempSync(join(tmpdir(), 'ipdrecon-'));
let browser;
before(async () => {
  browser = await visit();
});
after(async () => {
  rmSync(folder, { recursive: true });
  await browser.close();
});

const frames = 12;
const first = (extension) => `frame-000000.${extension}`;
const cut = (files, path) => ({ ...files, [path]: files[path].subarray(0, Math.floor(files[path].length / 2)) });
const without = (files, ...paths) => Object.fromEntries(Object.entries(files).filter(([path]) => !paths.includes(path)));
const only = (files, pattern) => Object.fromEntries(Object.entries(files).filter(([path]) => pattern.test(path)));

/** What is dropped, the file that must be named, and how many frames go on (0: the scan is refused). */
const cases = [
  ['no poses', (s) => only(s, /^(?!.*pose)/), /pose|folder|scan/i, 0],
  ['a pose with NaN', (s) => ({ ...s, [first('pose.txt')]: '1 0 0 nan\n0 1 0 0\n0 0 1 0\n0 0 0 1\n' }), first('pose.txt'), frames - 1],
  ['a pose with inf', (s) => ({ ...s, [first('pose.txt')]: '1 0 0 0\n0 1 0 -inf\n0 0 1 0\n0 0 0 1\n' }), first('pose.txt'), frames - 1],
  ['a pose that is no rotation', (s) => ({ ...s, [first('pose.txt')]: '2 0 0 0\n0 1 0 0\n0 0 1 0\n0 0 0 1\n' }), first('pose.txt'), frames - 1],
  ['no intrinsics', (s) => without(s, 'camera-intrinsics.txt'), 'camera-intrinsics.txt', 0],
  ['intrinsics of zero', (s) => ({ ...s, 'camera-intrinsics.txt': '0 0 48\n0 0 36\n0 0 1\n' }), 'camera-intrinsics.txt', 0],
  // Depth without its colour still gives a surface.
  ['a truncated photo', (s) => cut(s, first('color.png')), first('color.png'), frames],
  ['a truncated depth image', (s) => cut(s, first('depth.png')), first('depth.png'), frames - 1],
  ['depth of another size', (s) => ({ ...s, [first('depth.png')]: depthPng(0, { width: 31, height: 17 }) }), first('depth.png'), frames - 1],
  ['a missing depth image', (s) => without(s, first('depth.png')), /frame-000000/, frames - 1],
  ['a missing pose', (s) => without(s, first('pose.txt')), /frame-000000/, frames - 1],
];

for (const [what, spoil, named, goOn] of cases) {
  test(what, async () => {
    const path = put(join(folder, what.replaceAll(' ', '-')), spoil(scan(frames)));
    const visitor = await browser.open();
    await visitor.until('idle');
    await visitor.page.setInputFiles('#folder-input', path);
    await visitor.until(goOn > 0 ? 'finished' : 'failed');
    const findings = await visitor.events('finding');
    const finding = findings.map(({ finding }) => finding).find(({ file }) => file && (typeof named === 'string' ? file.endsWith(named) : named.test(file)));
    assert.ok(finding, `a finding names ${named}: ${JSON.stringify(findings)}`);
    const panel = await visitor.page.locator('#panel').innerText();
    for (const part of ['file', 'expected', 'found', 'advice']) {
      assert.ok(finding[part].length > 2, `${part}: ${finding[part]}`);
      assert.ok(panel.includes(finding[part]), `the panel says ${part}: ${panel}`);
    }
    if (finding.line !== undefined && finding.line !== null) assert.ok(panel.includes(`${finding.file}:${finding.line}`), `the panel names the line: ${panel}`);
    else assert.ok(!what.startsWith('a pose') && !what.startsWith('intrinsics'), 'what is wrong inside a text file has a line');
    if (goOn > 0) {
      const [finished] = await visitor.events('finished');
      assert.equal(finished.frames, goOn, 'what is sound goes on');
      assert.ok(finished.triangles > 100);
    } else {
      const [failed] = await visitor.events('failed');
      assert.equal(failed.code, 'scan');
      assert.ok(panel.includes(failed.message) && panel.includes(failed.advice));
      await visitor.page.getByRole('button', { name: 'Back to the start' }).click();
      await visitor.until('idle');
    }
    assert.deepEqual(visitor.errors, []);
    await visitor.close();
  });
}

/** Opens a file through the .zip button and gives what the page says of its failure. */
async function refused(name, buffer) {
  const visitor = await browser.open();
  await visitor.until('idle');
  await visitor.page.setInputFiles('#zip-input', { name, mimeType: 'application/zip', buffer });
  await visitor.until('failed');
  const said = await visitor.page.locator('#panel').innerText();
  assert.equal((await visitor.events('failed'))[0].code, 'scan');
  await visitor.close();
  return said;
}

test('a file that is not a zip', async () => {
  const said = await refused('holiday.zip', Buffer.from('these are only words'));
  assert.match(said, /holiday\.zip/);
  assert.match(said, /zip/);
});

test('a zip that is cut off', async () => {
  const whole = zip(scan(3));
  assert.match(await refused('half.zip', whole.subarray(0, whole.length / 2)), /half\.zip/);
});

test('a zip that reaches out of its folder', async () => {
  assert.match(await refused('sly.zip', zip({ ...scan(3), '../../outside.txt': 'no' })), /\.\.\/\.\.\/outside\.txt/);
});

test('a sound zip', async () => {
  const visitor = await browser.open();
  await visitor.until('idle');
  await visitor.page.setInputFiles('#zip-input', { name: 'box.zip', mimeType: 'application/zip', buffer: zip(scan(frames)) });
  await visitor.until('finished');
  assert.equal((await visitor.events('finished'))[0].frames, frames);
  assert.deepEqual(await visitor.events('finding'), []);
  await visitor.close();
});

test('an empty folder, dropped', async () => {
  const visitor = await browser.open();
  await visitor.until('idle');
  await visitor.drop(put(join(folder, 'nothing'), {}));
  await visitor.until('failed');
  const said = await visitor.page.locator('#panel').innerText();
  assert.match(said, /“nothing” is empty/);
  assert.match(said, /Drop the folder that holds the photos/);
  await visitor.close();
});

test('after a bad scan a good one can be dropped at once', async () => {
  const visitor = await browser.open();
  await visitor.until('idle');
  await visitor.drop(put(join(folder, 'nothing'), {}));
  await visitor.until('failed');
  await visitor.drop(put(join(folder, 'box'), scan(frames)));
  await visitor.until('finished');
  assert.equal((await visitor.events('finished'))[0].frames, frames);
  await visitor.close();
});
