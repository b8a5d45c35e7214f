// How many tests passed, failed and were skipped, read from what the test programs print.

/** @typedef {{ passed: number, failed: number, skipped: number }} Count */

const plain = (text) => text.replace(/\x1b\[[0-9;]*m/g, '');
const none = () => ({ passed: 0, failed: 0, skipped: 0 });

/** @param {Count[]} counts @returns {Count} */
export function sum(counts) {
  const total = none();
  for (const count of counts) {
    total.passed += count.passed;
    total.failed += count.failed;
    total.skipped += count.skipped;
  }
  return total;
}

/** Tests of cargo and of wasm-bindgen-test. A Rust test that cannot run prints `skipped: why` and passes; it is counted as skipped. */
function cargo(text) {
  const results = [...text.matchAll(/^test result: \w+\. (\d+) passed; (\d+) failed; (\d+) ignored/gm)];
  const total = sum(results.map(([, passed, failed, skipped]) => ({ passed: +passed, failed: +failed, skipped: +skipped })));
  const skipped = text.split(/^---- /m).slice(1).filter((section) => /^skipped: /m.test(section)).length;
  return { passed: total.passed - skipped, failed: total.failed, skipped: total.skipped + skipped };
}

/** `node --test`, in its TAP and its readable form. */
function node(text) {
  const figure = (name) => [...text.matchAll(new RegExp(`^(?:#|ℹ) ${name} (\\d+)$`, 'gm'))].reduce((total, [, n]) => total + +n, 0);
  return { passed: figure('pass'), failed: figure('fail') + figure('cancelled'), skipped: figure('skipped') + figure('todo') };
}

/** Python's unittest. */
function python(text) {
  const ran = +(/^Ran (\d+) tests?/m.exec(text)?.[1] ?? 0);
  const figure = (name) => +(new RegExp(`^(?:OK|FAILED) \\(.*\\b${name}=(\\d+)`, 'm').exec(text)?.[1] ?? 0);
  const failed = figure('failures') + figure('errors');
  return { passed: Math.max(0, ran - failed - figure('skipped')), failed, skipped: figure('skipped') };
}

const readers = { cargo, node, python };

/**
 * Counts one program's tests. `kind` 'check' is a program that is one test itself. A program that ends with an error has
 * failed even where it counts no failure, and one that finds no test at all has failed too.
 * @returns {Count}
 */
export function count(kind, { output, code }) {
  if (kind === 'check') return code === 0 ? { ...none(), passed: 1 } : { ...none(), failed: 1 };
  const counted = readers[kind](plain(output));
  const any = counted.passed + counted.failed + counted.skipped > 0;
  if ((code !== 0 || !any) && counted.failed === 0) counted.failed = 1;
  return counted;
}

/** The reasons that skipped tests gave. */
export const reasons = (text) => [...new Set([...plain(text).matchAll(/^\s*(skipped: .*|.*# SKIP.*|.*\.\.\. skipped .*)$/gm)].map(([, line]) => line.trim()))];

/** Where each kind of test program says what failed and why. */
const faults = [
  /^failures:\n\n([\s\S]*?)\n\nfailures:$/gm,
  /^✖ failing tests:\n([\s\S]*)/gm,
  /^={60,}\n((?:FAIL|ERROR): [\s\S]*?)(?=\n-{60,}\nRan )/gm,
];

/** What failed and why, of a program's output; its end where it does not say so in a known way. */
export function failures(text) {
  const found = faults.flatMap((fault) => [...plain(text).matchAll(fault)].map(([, said]) => said.trim()));
  return found.length > 0 ? found.join('\n\n') : plain(text).split('\n').slice(-100).join('\n').trim();
}

/** The files of `node --test` with a test that failed. */
export const failedFiles = (text) => [...new Set([...plain(text).matchAll(/^test at (.+?\.test\.mjs):/gm)].map(([, file]) => file))];

/** The targets of cargo whose tests failed, as arguments that choose them: `--test eval`, `--lib`. */
export const failedTargets = (text) => [...new Set([...plain(text).matchAll(/^ {4}`-p \S+ (--.+)`$/gm)].map(([, target]) => target))].flatMap((target) => target.split(' '));

/**
 * The count after a second try of what failed: what passes then has passed. A second run that finds no test, or that broke, mends nothing.
 * @param {Count} first @param {Count} second @returns {Count}
 */
export function afterSecondTry(first, second) {
  const failed = Math.max(second.failed, second.passed === 0 ? first.failed : 0);
  return { ...first, passed: Math.max(0, first.passed + first.failed - failed), failed };
}
