// What a visitor downloads: the engine, our own JavaScript and the weights stay within their budgets.
import assert from 'node:assert/strict';
import { readFileSync, readdirSync, statSync } from 'node:fs';
import { join } from 'node:path';
import { test } from 'node:test';
import { brotliCompressSync, constants, gzipSync } from 'node:zlib';
import { root } from '../../tools/run.mjs';

const ENGINE_BYTES = 2_500_000;
const SCRIPT_BYTES = 40_000;
const WEIGHTS_BYTES = 14_000_000;

test('the engine is at most 2.5 MB in brotli-11', (t) => {
  const wasm = readFileSync(join(root, 'www/dist/ipdrecon/engine_bg.wasm'));
  const params = { [constants.BROTLI_PARAM_QUALITY]: 11, [constants.BROTLI_PARAM_SIZE_HINT]: wasm.length };
  const bytes = brotliCompressSync(wasm, { params }).length;
  t.diagnostic(`engine: ${wasm.length} bytes raw, ${bytes} in brotli-11`);
  assert.ok(bytes <= ENGINE_BYTES, `${bytes} bytes, at most ${ENGINE_BYTES} expected`);
});

test('what libraries register is registered once, not at every entry from JavaScript', () => {
  const wasm = readFileSync(join(process.env.CARGO_TARGET_DIR ?? join(root, 'target'), 'wasm32-unknown-unknown/web/worker.wasm'));
  assert.ok(wasm.includes('__wasm_call_ctors'), 'the linker names what it makes');
  // So it calls the exports that it wraps in a call of all registrations.
  assert.ok(!wasm.includes('command_export'), 'the engine must call __wasm_call_ctors itself: worker/src/lib.rs');
});

test('our own JavaScript is at most 40 kB in gzip', (t) => {
  const dist = join(root, 'www/dist');
  const scripts = readdirSync(dist, { recursive: true }).filter((name) => name.endsWith('.js') && !name.endsWith('engine.js'));
  assert.ok(scripts.length > 5, `only ${scripts} found: is the site built?`);
  const bytes = scripts.map((name) => gzipSync(readFileSync(join(dist, name)), { level: 9 }).length).reduce((a, b) => a + b);
  t.diagnostic(`own scripts: ${bytes} bytes in gzip, ${scripts.length} files`);
  assert.ok(bytes <= SCRIPT_BYTES, `${bytes} bytes, at most ${SCRIPT_BYTES} expected`);
});

test('one file of weights is released, of at most 14 MB', (t) => {
  const folder = join(root, 'weights');
  const files = readdirSync(folder).filter((name) => name.endsWith('.safetensors'));
  assert.deepEqual(files, ['ipdrecon.safetensors']);
  const bytes = statSync(join(folder, files[0])).size;
  t.diagnostic(`weights: ${bytes} bytes`);
  assert.ok(bytes <= WEIGHTS_BYTES, `${bytes} bytes, at most ${WEIGHTS_BYTES} expected`);
});
