// A Python environment below .tools with the pinned packages of tests/reference; nothing but tests needs it.
import { createHash } from 'node:crypto';
import { existsSync, readFileSync, rmSync } from 'node:fs';
import { join } from 'node:path';
import { Missing, must, root, run, toolsDir, which } from '../run.mjs';
import { python } from '../env.mjs';
import { install, mayInstall } from './apt.mjs';
import { prove, proven } from './state.mjs';

const requirements = join(root, 'tests/reference/requirements.txt');
const venv = join(toolsDir, 'venv');

async function create() {
  rmSync(venv, { recursive: true, force: true });
  const base = which('python3') ?? which('python');
  return base !== null && (await run(base, ['-m', 'venv', venv])).code === 0;
}

export async function pythonPackages(say) {
  const key = createHash('sha256').update(readFileSync(requirements)).digest('hex');
  if (existsSync(python) && proven('python') === key) return;
  say('python3 -m venv, pip install -r tests/reference/requirements.txt');
  if (!(await create())) {
    if (!mayInstall()) throw new Missing('install Python 3 with its venv module (Debian: sudo apt-get install python3-venv)');
    await install(['python3-venv']);
    if (!(await create())) throw new Missing('python3 -m venv does not work here; install Python 3.11 or newer');
  }
  await must(python, ['-m', 'pip', 'install', '--quiet', '--disable-pip-version-check', '--only-binary', ':all:', '-r', requirements], { limitSeconds: 900 });
  prove('python', key);
}
