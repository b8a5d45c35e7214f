// A visitor's browser on the built page: what happened there is recorded, so that a test can ask for it afterwards.
import assert from 'node:assert/strict';
import { mkdirSync } from 'node:fs';
import { join } from 'node:path';
import { launch } from '../../tools/browser.mjs';
import { root, toolsDir } from '../../tools/run.mjs';
import { serve } from '../../tools/serve.mjs';
import { assertSmooth, mark, MARK, Trace } from './tasks.mjs';

/** Where pictures of the page are put, for people to look at. */
export const pictures = join(toolsDir, 'pictures');
mkdirSync(pictures, { recursive: true });

const events = ['ready', 'opened', 'weights', 'planned', 'stage', 'progress', 'bricks', 'paused', 'resumed', 'finished', 'finding', 'failed', 'exported', 'cameraChanged'];

/** Runs in the page before its own scripts: every event of the element and every long task, with its time. */
function record(types) {
  const record = { events: [], longTasks: [] };
  Object.assign(window, { record });
  for (const type of types) {
    document.addEventListener(`ipd-${type}`, ({ detail }) => record.events.push({ at_ms: performance.now(), ...detail }));
  }
  new PerformanceObserver((list) => record.longTasks.push(...list.getEntries().map(({ startTime, duration }) => ({ startTime, duration }))))
    .observe({ type: 'longtask', buffered: true });
}

/**
 * A site and a browser for the tests of one file. `device: 'gpu'` has its pages compute on WebGPU even where that is software, and would draw alone.
 * @param {{ webgpu?: boolean, device?: 'auto' | 'gpu' | 'cpu' }} [options]
 */
export async function visit({ device = 'auto', ...options } = {}) {
  const site = await serve(join(root, 'www/dist'), 0);
  const browser = await launch(options);
  let trace;
  return {
    url: site.url,
    /** A page in a window of its own, opened at `path`; `traced` if {@link Visitor.isSmooth} is to be asked. */
    async open({ path = '', width = 1280, height = 800, scheme = 'light', before, traced = false } = {}) {
      const context = await browser.newContext({ viewport: { width, height }, colorScheme: scheme, acceptDownloads: true });
      const page = await context.newPage();
      const errors = [];
      page.on('pageerror', (error) => errors.push(error.message));
      await page.addInitScript(record, events);
      // One that a failed test has left open ends here.
      await trace?.end();
      trace = traced ? await Trace.start(browser) : undefined;
      if (traced) await page.addInitScript(mark, MARK);
      await before?.(page);
      const address = new URL(path, site.url);
      if (device !== 'auto' && !address.searchParams.has('device')) address.searchParams.set('device', device);
      await page.goto(address.href);
      return new Visitor(page, errors, trace);
    },
    async close() {
      await browser.close();
      await site.close();
    },
  };
}

/** One open page. */
export class Visitor {
  #trace;

  constructor(page, errors, trace) {
    this.page = page;
    this.#trace = trace;
    /** What no code of the page has caught. */
    this.errors = errors;
  }

  /** Events of one kind so far. */
  events(type) {
    return this.page.evaluate((type) => window.record.events.filter((event) => event.type === type), type);
  }

  /** Tasks of the page's own thread that took over 50 ms. */
  longTasks() {
    return this.page.evaluate(() => window.record.longTasks);
  }

  /** Ends the trace of a page opened with `traced`: no task since {@link Visitor.forget} kept the page's thread from the visitor. */
  async isSmooth() {
    await this.#trace.end();
    const [long, elapsed_ms] = await this.page.evaluate(() => [window.record.longTasks, performance.now() - (window.record.from_ms ?? 0)]);
    return assertSmooth(this.#trace.worked_ms(), long, elapsed_ms);
  }

  state() {
    return this.page.evaluate(() => document.querySelector('ipd-recon').state);
  }

  /** Waits until the element is in one of these states; a failure that was not asked for ends the wait with its words. */
  until(...states) {
    return this.within(180_000, ...states);
  }

  /** As `until`, with another limit in milliseconds. */
  async within(timeout, ...states) {
    const reached = await this.page.waitForFunction((states) => {
      const { state } = document.querySelector('ipd-recon');
      return states.includes(state) || state === 'failed' ? state : false;
    }, states, { timeout, polling: 50 });
    const state = await reached.jsonValue();
    if (!states.includes(state)) throw new Error(`wanted ${states}, got: ${JSON.stringify(await this.events('failed'))} ${JSON.stringify(await this.events('finding'))}`);
    // The page draws a state in the frame after it.
    await this.page.evaluate(() => new Promise((resolve) => requestAnimationFrame(() => requestAnimationFrame(resolve))));
  }

  /** The next event of this kind, or one that was there already. */
  async event(type, timeout = 60_000) {
    await this.page.waitForFunction((type) => window.record.events.some((event) => event.type === type), type, { timeout, polling: 50 });
    return (await this.events(type)).at(-1);
  }

  /** Forgets what was recorded. */
  async forget() {
    await this.page.evaluate(() => Object.assign(window.record, { events: [] }));
    await this.forgetTasks();
  }

  /** Forgets the tasks of the page's thread, and nothing else. */
  async forgetTasks() {
    await this.page.evaluate(() => Object.assign(window.record, { longTasks: [], from_ms: performance.now() }));
    await this.page.evaluate(mark, MARK);
  }

  /** Drops real files or folders from the disk onto the page, as the system's file manager does. */
  async drop(paths, selector = 'body') {
    const box = await this.page.locator(selector).boundingBox();
    const at = { x: box.x + box.width / 2, y: box.y + Math.min(box.height, 600) / 2 };
    const session = await this.page.context().newCDPSession(this.page);
    const data = { items: [], files: [paths].flat(), dragOperationsMask: 1 };
    for (const type of ['dragEnter', 'dragOver', 'drop']) await session.send('Input.dispatchDragEvent', { type, ...at, data });
    await session.detach();
  }

  /** The file that a click on `selector` downloads. */
  async download(selector) {
    const [download] = await Promise.all([this.page.waitForEvent('download', { timeout: 120_000 }), this.page.click(selector)]);
    return download;
  }

  /** The canvas as it is on the screen, without the buttons over it: how many colours it has, and a hash of its pixels. */
  async picture() {
    const tools = (visibility) => this.page.evaluate((visibility) => document.getElementById('tools')?.style.setProperty('visibility', visibility), visibility);
    await tools('hidden');
    const png = await this.page.locator('ipd-recon').screenshot();
    await tools('');
    return this.page.evaluate(async (base64) => {
      const bytes = Uint8Array.from(atob(base64), (character) => character.charCodeAt(0));
      const bitmap = await createImageBitmap(new Blob([bytes], { type: 'image/png' }));
      const context = new OffscreenCanvas(bitmap.width, bitmap.height).getContext('2d');
      context.drawImage(bitmap, 0, 0);
      const { data } = context.getImageData(0, 0, bitmap.width, bitmap.height);
      const hash = await crypto.subtle.digest('SHA-256', data);
      return { colours: new Set(new Uint32Array(data.buffer)).size, hash: [...new Uint8Array(hash)].join() };
    }, png.toString('base64'));
  }

  async close() {
    await this.page.context().close();
  }
}
