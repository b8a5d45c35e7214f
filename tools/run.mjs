// Starting other programs, in one place: where the repository is, how output is kept, how a time limit ends a whole process group.
import { spawn } from 'node:child_process';
import { existsSync, mkdirSync, writeFileSync } from 'node:fs';
import { delimiter, dirname, join } from 'node:path';
import { fileURLToPath, pathToFileURL } from 'node:url';

export const root = dirname(dirname(fileURLToPath(import.meta.url)));
/** Whether the module of this `import.meta.url` is the program that was started. */
export const isMain = (url) => Boolean(process.argv[1]) && pathToFileURL(process.argv[1]).href === url;
/** Everything the set-up installs outside the system lies here; git ignores it. */
export const toolsDir = join(root, '.tools');

/** A thing that is absent and that only the user can bring; the message is one line and names the command. */
export class Missing extends Error {}

/** A program that ended with an error; the message names it, `output` is what it said. */
export class Failed extends Error {
  constructor(what, result) {
    super(`${what} ${result.timedOut ? `took longer than ${result.limitSeconds} s` : `ended with code ${result.code}`}`);
    this.output = result.output;
  }
}

/** The process groups that are running; they end with this process. */
const groups = new Set();
function stop() {
  for (const group of groups) killGroup(group);
  process.exit(130);
}
process.on('SIGINT', stop).on('SIGTERM', stop);

function killGroup(pid) {
  try {
    process.kill(-pid, 'SIGKILL');
  } catch {
    // It has ended meanwhile.
  }
}

/** The full path of a program on PATH, or null. */
export function which(program, path = process.env.PATH ?? '') {
  const endings = process.platform === 'win32' ? ['.exe', '.cmd', ''] : [''];
  for (const folder of path.split(delimiter)) {
    for (const ending of endings) {
      const candidate = join(folder, program + ending);
      if (folder && existsSync(candidate)) return candidate;
    }
  }
  return null;
}

/**
 * Runs a program to its end without a shell and without standard input. Its output is kept, and shown as it comes where `show` is set.
 * Never rejects: a program that cannot be started has code 127.
 */
export function run(program, args, { cwd = root, env = process.env, limitSeconds = 0, show = false, input = '' } = {}) {
  return new Promise((resolve) => {
    const own = limitSeconds > 0 && process.platform !== 'win32';
    const child = spawn(program, args, { cwd, env, detached: own, stdio: ['pipe', 'pipe', 'pipe'], shell: process.platform === 'win32' && /\.cmd$/.test(program) });
    if (own && child.pid) groups.add(child.pid);
    let output = '';
    let timedOut = false;
    const timer = limitSeconds <= 0 ? undefined : setTimeout(() => {
      timedOut = true;
      if (own) killGroup(child.pid);
      else child.kill('SIGKILL');
    }, limitSeconds * 1000);
    const keep = (stream) => (chunk) => {
      output += chunk;
      if (show) stream.write(chunk);
    };
    child.stdout.setEncoding('utf8').on('data', keep(process.stdout));
    child.stderr.setEncoding('utf8').on('data', keep(process.stderr));
    child.stdin.on('error', () => {}).end(input);
    const end = (code) => {
      clearTimeout(timer);
      groups.delete(child.pid);
      resolve({ code, output, timedOut, limitSeconds });
    };
    child.on('error', (error) => {
      output += `${error.message}\n`;
      end(127);
    });
    child.on('close', (code) => end(timedOut ? 124 : (code ?? 1)));
  });
}

/** As `run`, but an error code throws `Failed`. Gives back the output. */
export async function must(program, args, options) {
  const result = await run(program, args, options);
  if (result.code !== 0) throw new Failed([program, ...args].join(' '), result);
  return result.output;
}

export const seconds = (since) => `${((performance.now() - since) / 1000).toFixed(1)} s`;

/** Writes a file and the folders above it. */
export function write(path, text) {
  mkdirSync(dirname(path), { recursive: true });
  writeFileSync(path, text);
}
