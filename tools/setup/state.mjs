// What an earlier set-up has proven, so that a second one need not: a name and the key (versions, hashes) under which it was shown to work.
import { readFileSync } from 'node:fs';
import { join } from 'node:path';
import { toolsDir, write } from '../run.mjs';

const path = join(toolsDir, 'state.json');

function read() {
  try {
    return JSON.parse(readFileSync(path, 'utf8'));
  } catch {
    return {};
  }
}

/** The value proven for `name`, or undefined. */
export const proven = (name) => read()[name];

/** Keeps what was proven for `name`. */
export function prove(name, value) {
  write(path, `${JSON.stringify({ ...read(), [name]: value }, null, 2)}\n`);
}
