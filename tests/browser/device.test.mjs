// Machines that lack something: the page works on what there is, or says in one sentence why not.
import assert from 'node:assert/strict';
import { test } from 'node:test';
import { visit } from './launch.mjs';

/** A browser that is closed when its test is over, however it ends. */
async function browserFor(t, options) {
  const browser = await visit(options);
  t.after(() => browser.close());
  return browser;
}

test('without WebGPU the sample is made on the CPU, and the page says so', async (t) => {
  const browser = await browserFor(t, { webgpu: false });
  const visitor = await browser.open();
  const { page } = visitor;
  await visitor.until('idle');
  const ready = await visitor.event('ready');
  assert.equal(ready.device, 'cpu');
  assert.match(ready.note, /^[\w ,:]+$/, 'a sentence for people');
  assert.match(ready.note, /no WebGPU.*processor/);
  assert.match(ready.adapter, /adapter/, 'why, for the report');
  assert.equal(await page.locator('#device-note').innerText(), ready.note);
  assert.equal(await page.locator('#device').innerText(), 'CPU');
  await page.click('#sample');
  await visitor.until('finished');
  assert.ok((await visitor.events('finished'))[0].triangles > 1000);
  assert.ok((await visitor.picture()).colours > 8, 'the room is in the picture');
  assert.deepEqual(visitor.errors, []);
});

const lacking = [
  ['OffscreenCanvas', /OffscreenCanvas/, () => delete window.OffscreenCanvas],
  ['WebAssembly SIMD', /SIMD/, () => Object.assign(WebAssembly, { validate: () => false })],
  ['module workers', /module workers/, () => Object.assign(window, { Worker: class { terminate() {} } })],
];

test('a browser that is too old is told so before anything large is loaded', async (t) => {
  const browser = await browserFor(t);
  for (const [what, words, remove] of lacking) {
    await t.test(what, async () => {
      const asked = [];
      const visitor = await browser.open({
        before: async (page) => {
          page.on('request', (request) => asked.push(request.url()));
          await page.addInitScript(remove);
        },
      });
      await visitor.page.locator('#failure-advice').waitFor();
      assert.match(await visitor.page.locator('#panel-title').innerText(), words);
      assert.match(await visitor.page.locator('#failure-advice').innerText(), /Chrome.*Firefox.*Safari/);
      assert.deepEqual(asked.filter((url) => /wasm|worker\.js|engine\.js/.test(url)), []);
      await visitor.close();
    });
  }
});

test('an engine that cannot be loaded is one sentence, a report and a way back', async (t) => {
  const browser = await browserFor(t);
  let broken = true;
  const visitor = await browser.open({
    before: (page) => page.context().route('**/engine_bg.wasm', (route) => (broken ? route.fulfill({ status: 404, body: 'gone' }) : route.continue())),
  });
  const { page } = visitor;
  const failed = await visitor.event('failed');
  await visitor.until('failed');
  assert.equal(failed.code, 'internal');
  assert.equal(await page.locator('#panel-title').innerText(), failed.message);
  assert.match(failed.message, /could not be loaded/);
  await page.getByText('Report').click();
  const report = await page.locator('#report').innerText();
  for (const word of ['IPDRecon', 'internal', 'Chrome']) assert.ok(report.includes(word), `the report has ${word}: ${report}`);
  broken = false;
  await page.getByRole('button', { name: 'Back to the start' }).click();
  await visitor.until('idle');
  assert.equal((await visitor.events('ready')).length, 1);
});

test('an engine that crashes is told once, and the next scan gets a new one', async (t) => {
  // The worker script alone is tried here: an engine that traps on its first request stands in for the real one.
  const trap = `export default async () => {};
    export class Engine {
      static async start(_canvas, _request, emit) { emit({ type: "ready", device: "cpu", adapter: "none" }); return new Engine(); }
      computes = true;
      handle({ type }) {
        if (type !== "openSample") return;
        setTimeout(() => { throw new WebAssembly.RuntimeError("unreachable"); });
        setTimeout(() => { throw new WebAssembly.RuntimeError("unreachable"); }, 20);
        Promise.reject(new WebAssembly.RuntimeError("unreachable"));
      }
    }`;
  const browser = await browserFor(t);
  let broken = true;
  const visitor = await browser.open({
    before: (page) => page.context().route('**/engine.js', (route) => (broken ? route.fulfill({ contentType: 'text/javascript', body: trap }) : route.continue())),
  });
  const { page } = visitor;
  await visitor.until('idle');
  await page.click('#sample');
  await visitor.until('failed');
  await page.waitForTimeout(200);
  const failures = await visitor.events('failed');
  assert.equal(failures.length, 1);
  assert.match(failures[0].message, /unreachable/);
  assert.ok(failures[0].advice.length > 10);
  broken = false;
  await page.click('#failure-back');
  await visitor.until('idle');
  await page.click('#sample');
  await visitor.until('running', 'finished');
});
