// What the page's own thread works on. The browser's long tasks are by the clock, and on a machine that has other things to do a thread that
// waits for its turn has one: the trace knows for how long the thread did work.
import assert from 'node:assert/strict';

const CATEGORIES = ['disabled-by-default-devtools.timeline', 'blink.user_timing'];
export const MARK = 'tasks-from-here';
/**
 * What long tasks by the clock may take together, as a share of the journey: a thread may wait for its turn, not stand still. In a short
 * journey the start, where the engine is compiled beside the page, is much of it (283 ms with the whole browser on one core).
 */
const WAITING = { share: 0.02, least_ms: 500 };

/** Runs in the page: what was done before the mark is not counted. */
export function mark(name) {
  performance.mark(name);
}

/** A trace of one page; a browser takes one at a time. */
export class Trace {
  #session;
  #events = [];
  #open = true;

  constructor(session) {
    this.#session = session;
    session.on('Tracing.dataCollected', ({ value }) => this.#events.push(...value));
  }

  static async start(browser) {
    const session = await browser.newBrowserCDPSession();
    const traceConfig = { recordMode: 'recordContinuously', includedCategories: CATEGORIES, excludedCategories: ['*'] };
    const trace = new Trace(session);
    await session.send('Tracing.start', { traceConfig, transferMode: 'ReportEvents' });
    return trace;
  }

  /** Ends it, if that was not done. */
  async end() {
    if (!this.#open) return;
    this.#open = false;
    const complete = new Promise((resolve) => this.#session.once('Tracing.tracingComplete', resolve));
    await this.#session.send('Tracing.end');
    await complete;
    await this.#session.detach();
  }

  /** For how long each task of the page's thread since the last mark worked, milliseconds, the longest first. */
  worked_ms() {
    const from = this.#events.filter(({ name }) => name === MARK).sort((a, b) => a.ts - b.ts).at(-1);
    assert.ok(from, 'the trace has the mark');
    return this.#events
      .filter(({ name, ph, pid, tid, ts }) => name === 'RunTask' && ph === 'X' && pid === from.pid && tid === from.tid && ts > from.ts)
      .map(({ tdur = 0 }) => tdur / 1000)
      .sort((a, b) => b - a);
  }
}

/**
 * In a journey too long to be made again: no task worked for over 50 ms, and those that were long by the clock are few.
 * @param {number[]} worked_ms milliseconds of work of each task, the longest first
 * @param {{ startTime: number, duration: number }[]} long tasks over 50 ms by the clock
 * @param {number} elapsed_ms of the journey
 */
export function assertSmooth(worked_ms, long, elapsed_ms) {
  const told = `work of the longest tasks ${worked_ms.slice(0, 3).map((ms) => ms.toFixed(1)).join(', ')} ms; long by the clock: ${JSON.stringify(long)}`;
  assert.ok(worked_ms.length > 0 && worked_ms[0] <= 50, told);
  const waited_ms = long.reduce((sum, { duration }) => sum + duration, 0);
  assert.ok(waited_ms <= Math.max(WAITING.share * elapsed_ms, WAITING.least_ms), `${told} in ${elapsed_ms.toFixed(0)} ms`);
  return told;
}
