// The npm packages of the lock file, installed again only when the lock has changed.
import { createHash } from 'node:crypto';
import { existsSync, readFileSync } from 'node:fs';
import { join } from 'node:path';
import { must, root, write } from '../run.mjs';

const stamp = join(root, 'node_modules/.installed-lock');

export async function npmPackages(say) {
  const lock = createHash('sha256').update(readFileSync(join(root, 'package-lock.json'))).digest('hex');
  if (existsSync(stamp) && readFileSync(stamp, 'utf8') === lock) return;
  say('npm ci');
  const npm = process.platform === 'win32' ? 'npm.cmd' : 'npm';
  await must(npm, ['ci', '--no-audit', '--no-fund'], { limitSeconds: 900 });
  write(stamp, lock);
}
