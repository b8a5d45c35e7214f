// Parts of BENCHMARKS.md that tools write apart from each other, between two marks.
import { readFileSync, writeFileSync } from 'node:fs';
import { join } from 'node:path';
import { root } from '../run.mjs';

const file = join(root, 'BENCHMARKS.md');
const marks = (name) => [`<!-- ${name} -->`, `<!-- end of ${name} -->`];

/** `page` with the part `name` set to `text`; at its end where there was none. */
export function withSection(page, name, text) {
  const [begin, end] = marks(name);
  const part = `${begin}\n${text.trim()}\n${end}`;
  const [from, to] = [page.indexOf(begin), page.indexOf(end)];
  if (from < 0 || to < from) return `${page.trimEnd()}\n\n${part}\n`;
  return page.slice(0, from) + part + page.slice(to + end.length);
}

/** All such parts of a page, one after the other. */
export function sections(page) {
  return [...page.matchAll(/<!-- ([\w-]+) -->\n[\s\S]*?<!-- end of \1 -->/g)].map(([part]) => part).join('\n\n');
}

/** Writes a part into BENCHMARKS.md. */
export function record(name, text) {
  writeFileSync(file, withSection(readFileSync(file, 'utf8'), name, text));
}

const ms = (value) => value.toFixed(value < 100 ? 2 : 0);

/** The comparisons with ONNX Runtime Web as a table; those that failed as sentences below. */
export function comparisons(found) {
  const rows = found.flatMap(({ device, comparisons }) => comparisons.filter(({ failed }) => !failed)
    .map((row) => `| ${device} | ${row.width}x${row.height} | ${ms(row.ours_ms)} | ${ms(row.theirs_ms)} | ${row.ratio.toFixed(2)} | ${ms(row.ourCold_ms)} | ${ms(row.theirCold_ms)} | ${row.off.toExponential(0)} |`));
  const failed = found.flatMap(({ device, comparisons }) => comparisons.filter(({ failed }) => failed)
    .map(({ width, height, failed }) => `Not compared on ${device} at ${width}x${height}: ${failed}`));
  const head = '| device | picture | ours ms | ONNX Runtime Web ms | theirs / ours | ours cold ms | theirs cold ms | apart |\n|---|---|---|---|---|---|---|---|';
  return [[head, ...rows].join('\n'), ...failed].join('\n\n');
}

/** Says what a table of comparisons is. */
export const aboutComparisons = (version) => `Backbone and pyramid of a picture, the same released weights in both (${version}, the model written by \`tools/bench/onnx.mjs\`), in turns in one process: medians of up to 7 rounds of 5
runs each. The picture is on the device before; a run ends when the device has done its work. *Apart* is the largest difference of the two results as a share of
the largest number; above 1e-3 there is no row. Cold: the first run, theirs with the session that it needs.`;
