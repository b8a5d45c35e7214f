// How good weights are on scans they have not seen, beside what a guess and stereo get: a Markdown table of means.
//
//   node tools/held-out.mjs --scans DIR [--weights NAME=FILE]... [--mesh NAME=FILE]... [--stereo] [--views N] [--json FILE]
//
// DIR holds scans with depth, such as `ipdrecon synth` makes; truth is fused from that depth. A mesh given by --mesh is the
// same guess for every scan.
import { execFileSync } from 'node:child_process';
import { mkdtempSync, readdirSync, rmSync, writeFileSync } from 'node:fs';
import { tmpdir } from 'node:os';
import { join } from 'node:path';
import { parseArgs } from 'node:util';

const { values } = parseArgs({
  options: {
    scans: { type: 'string' },
    weights: { type: 'string', multiple: true, default: [] },
    mesh: { type: 'string', multiple: true, default: [] },
    stereo: { type: 'boolean', default: false },
    views: { type: 'string', default: '20' },
    reach: { type: 'string', default: '3' },
    json: { type: 'string' },
    ipdrecon: { type: 'string', default: join(import.meta.dirname, '..', 'target', 'release', 'ipdrecon') },
  },
});
const folder = values.scans;
if (!folder) throw new Error('expected --scans with a folder of scans, found none');

const work = mkdtempSync(join(tmpdir(), 'held-out-'));
const ipdrecon = (...args) => execFileSync(values.ipdrecon, args, { encoding: 'utf8', stdio: ['ignore', 'pipe', 'pipe'] });
const named = (text) => {
  const at = text.indexOf('=');
  if (at < 1) throw new Error(`expected NAME=FILE, found ${text}`);
  return [text.slice(0, at), text.slice(at + 1)];
};
// Each method writes a mesh of a scan and gives its file; it throws where there is none.
const methods = [
  ...values.mesh.map(named).map(([name, file]) => [name, () => file]),
  ...values.weights.map(named).map(([name, file]) => [
    name,
    (scan, out) => {
      ipdrecon('reconstruct', scan, '--weights', file, '--views', values.views, '--reach', values.reach, '-o', out);
      return out;
    },
  ]),
];
if (values.stereo) {
  methods.push(['stereo', (scan, out) => {
    ipdrecon('stereo', scan, '-o', out);
    return out;
  }]);
}

// What TransformerFusion's protocol gives a scene without a mesh.
const nothing = { accuracy_m: 1, completeness_m: 1, precision: 1, recall: 0, f_score: 0 };
const columns = Object.keys(nothing);
/** @type {{ name: string, scans: Record<string, number>[], empty: number }[]} */
const rows = methods.map(([name]) => ({ name, scans: [], empty: 0 }));
try {
  const scans = readdirSync(folder).sort().map((name) => join(folder, name));
  for (const scan of scans) {
    const truth = join(work, 'truth.ply');
    ipdrecon('fuse', scan, '--max-depth', values.reach, '-o', truth);
    for (const [i, [name, make]] of methods.entries()) {
      let found = nothing;
      try {
        const pred = make(scan, join(work, 'pred.ply'));
        const text = ipdrecon('eval', '--pred', pred, '--gt', truth, '--scan', scan, '--protocol', 'transformerfusion', '--json');
        found = JSON.parse(text).surface ?? JSON.parse(text);
      } catch (error) {
        rows[i].empty += 1;
        console.error(`${name}, ${scan}: no mesh: ${String(error.stderr ?? error).trim().split('\n').at(-1)}`);
      }
      rows[i].scans.push(Object.fromEntries(columns.map((column) => [column, found[column]])));
      console.error(`${name}, ${scan}: F ${found.f_score.toFixed(3)}`);
    }
  }
} finally {
  rmSync(work, { recursive: true, force: true });
}

const mean = (row, column) => row.scans.reduce((sum, scan) => sum + scan[column], 0) / row.scans.length;
console.log(`Means over ${rows[0]?.scans.length ?? 0} scans, TransformerFusion's protocol, 5 cm, ${values.views} views a tile, within ${values.reach} m\n`);
console.log('| | Acc (m) | Comp (m) | Prec | Recall | F | scans without a mesh |\n|---|---|---|---|---|---|---|');
for (const row of rows) {
  console.log(`| ${row.name} | ${columns.map((column) => mean(row, column).toFixed(3)).join(' | ')} | ${row.empty} |`);
}
if (values.json) writeFileSync(values.json, JSON.stringify(rows, null, 1));
