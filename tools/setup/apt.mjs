// Debian's and Ubuntu's packages: install what is named, or say in one line how the user can.
import { existsSync, readFileSync, writeFileSync } from 'node:fs';
import { Missing, must, run, which } from '../run.mjs';

const env = { ...process.env, DEBIAN_FRONTEND: 'noninteractive' };
const keyring = '/usr/share/keyrings/debian-archive-keyring.gpg';
/** @type {Promise<unknown> | null} */
let updated = null;
let queue = Promise.resolve();

export const hasApt = () => process.platform === 'linux' && which('apt-get') !== null;
export const mayInstall = () => hasApt() && process.getuid?.() === 0;

/** The release's name in Debian's and Ubuntu's words, such as `bookworm`, and the distribution's, such as `debian`. */
export function release() {
  try {
    const text = readFileSync('/etc/os-release', 'utf8');
    const field = (name) => new RegExp(`^${name}="?([^"\n]*)`, 'm').exec(text)?.[1] ?? '';
    return { distribution: field('ID'), codename: field('VERSION_CODENAME') };
  } catch {
    return { distribution: '', codename: '' };
  }
}

const update = () => (updated ??= run('apt-get', ['update', '-q'], { env, limitSeconds: 300 }));

/** The version apt would install, or null where the package is unknown. */
export async function candidate(name) {
  if (mayInstall()) await update();
  const policy = await run('apt-cache', ['policy', name], { env: { ...env, LC_ALL: 'C' } });
  const version = /Candidate: (\S+)/.exec(policy.output)?.[1];
  return version && version !== '(none)' ? version : null;
}

/** Installs packages, one call at a time as dpkg wants it; `suite` is a release to take them from. */
export function install(packages, suite) {
  const words = ['install', '-y', '-q', '--no-install-recommends', ...(suite ? ['-t', suite] : []), ...packages];
  if (!hasApt()) throw new Missing(`install ${packages.join(', ')} with your package manager (this machine has no apt)`);
  if (!mayInstall()) throw new Missing(`run: sudo apt-get ${words.slice(0, 1).concat(words.slice(4)).join(' ')}`);
  const turn = queue.then(async () => {
    await update();
    await must('apt-get', words, { env, limitSeconds: 900 });
  });
  queue = turn.catch(() => {});
  return turn;
}

/** Adds the release's backports, from the mirror that the machine already uses, and gives the suite's name. */
export async function addBackports() {
  const { distribution, codename } = release();
  const suite = `${codename}-backports`;
  const known = await run('apt-get', ['indextargets', '--format', '$(REPO_URI)|$(RELEASE)|$(COMPONENT)', 'Identifier: Packages']);
  const sources = known.output.trim().split('\n').map((line) => line.split('|'));
  if (sources.some(([, name]) => name === suite)) return suite;
  const base = sources.find(([, name, component]) => name === codename && component === 'main');
  if (distribution !== 'debian' || !base) return null;
  if (!mayInstall()) throw new Missing(`run: echo 'deb ${base[0]} ${suite} main' | sudo tee /etc/apt/sources.list.d/${suite}.list && sudo apt-get update`);
  const signed = existsSync(keyring) ? `Signed-By: ${keyring}\n` : '';
  writeFileSync(`/etc/apt/sources.list.d/${suite}.sources`, `Types: deb\nURIs: ${base[0]}\nSuites: ${suite}\nComponents: main\n${signed}`);
  updated = null;
  await update();
  return suite;
}
