// Proves the whole chain: makes a room, trains on it alone, reconstructs it from its pictures and compares. Half an hour on four cores.
//
//   node tools/overfit.mjs [--folder DIR] [--ipdrecon FILE]
import { execFileSync } from 'node:child_process';
import { mkdirSync, readdirSync } from 'node:fs';
import { join, resolve } from 'node:path';
import { parseArgs } from 'node:util';

const root = join(import.meta.dirname, '..');
const { values } = parseArgs({
  options: {
    folder: { type: 'string', default: join(root, 'target', 'overfit') },
    ipdrecon: { type: 'string', default: join(root, 'target', 'release', 'ipdrecon') },
  },
});
const folder = resolve(values.folder);
mkdirSync(folder, { recursive: true });
/** @param {string[]} args */
const ipdrecon = (...args) => execFileSync(resolve(values.ipdrecon), args, { cwd: folder, encoding: 'utf8', stdio: ['ignore', 'pipe', 'inherit'] });

const scan = join(folder, 'rooms', 'one', 'room-000011');
ipdrecon('synth', '--seeds', '11..12', '--size', '320x240', '-o', 'rooms/one');
ipdrecon('train', '--config', join(root, 'crate', 'train', 'configs', 'overfit.toml'));
const last = readdirSync(join(folder, 'runs', 'overfit')).filter((name) => name.startsWith('step-')).sort().at(-1) ?? '';
const weights = join(folder, 'runs', 'overfit', last, 'weights.safetensors');
ipdrecon('reconstruct', scan, '--weights', weights, '--size', '320x240', '--views', '20', '--reach', '3', '-o', 'one.ply');
ipdrecon('fuse', scan, '--max-depth', '3', '-o', 'truth.ply');
console.log(`after ${last}, ${join(folder, 'one.ply')} against the fused depth:`);
console.log(ipdrecon('eval', '--pred', 'one.ply', '--gt', 'truth.ply', '--scan', scan, '--protocol', 'transformerfusion'));
