// The page as people see it, hear it and reach it: two widths, light and dark, only the keyboard, and the rules of axe.
import assert from 'node:assert/strict';
import { readFileSync } from 'node:fs';
import { createRequire } from 'node:module';
import { join } from 'node:path';
import { after, before, test } from 'node:test';
import { pictures, visit } from './launch.mjs';

const axe = readFileSync(createRequire(import.meta.url).resolve('axe-core/axe.min.js'), 'utf8');
let browser;
before(async () => {
  browser = await visit();
});
after(() => browser.close());

/** Saves a picture; fails where the page is wider than the window or breaks a rule of axe. */
async function inspect({ page }, name) {
  await page.screenshot({ path: join(pictures, `${name}.png`) });
  const overflow = await page.evaluate(() => document.documentElement.scrollWidth - innerWidth);
  assert.ok(overflow <= 0, `${name}: ${overflow} px wider than the window`);
  await page.evaluate(axe);
  const found = await page.evaluate(async () => (await window.axe.run(document)).violations.map(({ id, nodes }) => `${id}: ${nodes.map(({ target }) => target)}`));
  assert.deepEqual(found, [], name);
}

for (const [width, height] of [[1280, 800], [360, 740]]) {
  for (const scheme of ['light', 'dark']) {
    test(`${width} px wide, ${scheme}`, async () => {
      const visitor = await browser.open({ width, height, scheme });
      const { page } = visitor;
      const name = (what) => `${what}-${width}-${scheme}`;
      await visitor.until('idle');
      await inspect(visitor, name('start'));
      await page.click('#sample');
      await visitor.event('bricks');
      await inspect(visitor, name('running'));
      await visitor.until('finished');
      await inspect(visitor, name('finished'));
      assert.ok((await visitor.picture()).colours > 8, 'the room is in the picture');
      await page.click('#help-open');
      await inspect(visitor, name('help'));
      await page.keyboard.press('Escape');
      await page.click('#new-scan');
      await visitor.until('idle');
      await page.setInputFiles('#zip-input', { name: 'notes.zip', mimeType: 'application/zip', buffer: Buffer.from('no archive') });
      await visitor.until('failed');
      await inspect(visitor, name('failed'));
      await page.goto(`${browser.url}?sample&autostart=0`);
      await visitor.until('planned');
      await page.getByLabel('Depth from').selectOption('stereo');
      await page.getByLabel('Photos scaled to').waitFor();
      await inspect(visitor, name('plan'));
      await page.getByLabel('Depth from').selectOption('the network');
      await page.getByText('Weights: those of this page').waitFor();
      await inspect(visitor, name('plan-network'));
      await visitor.close();
    });
  }
}

test('the whole way with nothing but the keyboard', async () => {
  const visitor = await browser.open();
  const { page } = visitor;
  await visitor.until('idle');
  const tabTo = async (selector) => {
    for (let tabs = 0; tabs < 40; tabs += 1) {
      await page.keyboard.press('Tab');
      if (await page.evaluate((selector) => document.activeElement?.matches(selector), selector)) return;
    }
    assert.fail(`Tab does not lead to ${selector}`);
  };
  await tabTo('#sample');
  await page.keyboard.press('Enter');
  await visitor.until('running');
  assert.equal(await page.evaluate(() => document.activeElement.id), 'panel-title', 'the focus does not get lost');
  await visitor.until('finished');
  await page.evaluate(() => document.body.focus());
  await tabTo('ipd-recon');
  const outline = await page.evaluate(() => getComputedStyle(document.querySelector('ipd-recon').shadowRoot.activeElement).outlineStyle);
  assert.notEqual(outline, 'none', 'the focus can be seen');
  const before = await visitor.picture();
  await page.keyboard.down('ArrowLeft');
  await page.waitForTimeout(400);
  await page.keyboard.up('ArrowLeft');
  await visitor.event('cameraChanged');
  assert.notEqual((await visitor.picture()).hash, before.hash, 'an arrow key turns the view');
  const status = () => page.evaluate(() => document.querySelector('ipd-recon').shadowRoot.querySelector('[role=status]').textContent);
  assert.equal(await status(), (await visitor.events('cameraChanged')).at(-1).description, 'the new view is said');
  await tabTo('[data-format=glb]');
  const [download] = await Promise.all([page.waitForEvent('download'), page.keyboard.press('Enter')]);
  assert.match(download.suggestedFilename(), /\.glb$/);
  await visitor.close();
});

test('the theme follows the system until another is chosen, and the choice is kept', async () => {
  const visitor = await browser.open({ scheme: 'dark' });
  const { page } = visitor;
  const background = () => page.evaluate(() => getComputedStyle(document.body).backgroundColor);
  const dark = await background();
  await page.click('#theme');
  const light = await background();
  assert.notEqual(light, dark);
  await page.reload();
  assert.equal(await background(), light);
  await page.click('#theme');
  await page.emulateMedia({ colorScheme: 'light' });
  assert.equal(await background(), light, 'choosing what the system has means following it');
  await visitor.close();
});

test('nothing is asked of any other machine', async () => {
  const asked = [];
  const visitor = await browser.open({ path: '?sample', before: (page) => page.on('request', (request) => asked.push(request.url())) });
  await visitor.until('finished');
  const elsewhere = asked.filter((url) => !url.startsWith(browser.url) && !url.startsWith('blob:'));
  assert.deepEqual(elsewhere, []);
  assert.match(await visitor.page.locator('meta[http-equiv=Content-Security-Policy]').getAttribute('content'), /connect-src 'self'/);
  await visitor.close();
});
