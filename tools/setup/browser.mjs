// Chromium for the browser tests: the system's, Debian's package, or the one Playwright brings.
import { existsSync } from 'node:fs';
import { join } from 'node:path';
import { Missing, must, root, run, which } from '../run.mjs';
import { install, mayInstall, release } from './apt.mjs';
import { prove, proven } from './state.mjs';

/** Says its version, which a package that is only a pointer to a snap does not. */
const starts = async (path) => path !== null && existsSync(path) && (await run(path, ['--version'], { limitSeconds: 30 })).code === 0;

async function keep(path) {
  if (!(await starts(path))) return false;
  prove('chromium', path);
  return true;
}

async function playwrightPath() {
  const { chromium } = await import('playwright-core');
  return chromium.executablePath();
}

export async function chromium(say) {
  const known = proven('chromium');
  if (known && existsSync(known)) return;
  for (const name of ['chromium', 'chromium-browser', 'google-chrome']) {
    if (await keep(which(name))) return;
  }
  if (await keep(await playwrightPath())) return;
  if (release().distribution === 'debian') {
    say('apt-get install chromium');
    await install(['chromium']);
    if (await keep(which('chromium'))) return;
  }
  const words = ['playwright-core', 'install', ...(mayInstall() ? ['--with-deps'] : []), 'chromium'];
  say(`npx ${words.join(' ')}`);
  await must(process.execPath, [join(root, 'node_modules/playwright-core/cli.js'), ...words.slice(1)], { limitSeconds: 900 });
  if (!(await keep(await playwrightPath()))) throw new Missing('run: npx playwright-core install --with-deps chromium');
}
