import assert from 'node:assert/strict';
import { mkdirSync, mkdtempSync, rmSync, writeFileSync } from 'node:fs';
import { connect } from 'node:net';
import { tmpdir } from 'node:os';
import { join } from 'node:path';
import { after, before, test } from 'node:test';
import { serve } from './serve.mjs';

let folder;
let server;

before(async () => {
  folder = mkdtempSync(join(tmpdir(), 'serve-'));
  mkdirSync(join(folder, 'site/ipdrecon'), { recursive: true });
  writeFileSync(join(folder, 'site/index.html'), '<p>page</p>');
  writeFileSync(join(folder, 'site/ipdrecon/engine_bg.wasm'), 'wasm');
  writeFileSync(join(folder, 'secret.txt'), 'secret');
  mkdirSync(join(folder, 'site-two'));
  writeFileSync(join(folder, 'site-two/index.html'), 'secret');
  server = await serve(join(folder, 'site'), 0);
});

after(async () => {
  await server.close();
  rmSync(folder, { recursive: true, force: true });
});

/** The answer to a path exactly as written, which fetch would tidy up first. */
const raw = (path) => new Promise((resolve, reject) => {
  let text = '';
  const socket = connect(server.port, '127.0.0.1', () => socket.end(`GET ${path} HTTP/1.1\r\nHost: localhost\r\nConnection: close\r\n\r\n`));
  socket.on('data', (chunk) => (text += chunk)).on('end', () => resolve(text)).on('error', reject);
});

test('serves the page and wasm with their types and no special headers', async () => {
  const page = await fetch(server.url);
  assert.equal(page.status, 200);
  assert.equal(page.headers.get('content-type'), 'text/html; charset=utf-8');
  assert.equal(page.headers.get('cross-origin-opener-policy'), null);
  assert.equal(await page.text(), '<p>page</p>');
  const wasm = await fetch(`${server.url}ipdrecon/engine_bg.wasm`);
  assert.equal(wasm.headers.get('content-type'), 'application/wasm');
  assert.equal(await wasm.text(), 'wasm');
});

test('a path never leaves the folder', async () => {
  for (const path of ['/../secret.txt', '/%2e%2e/secret.txt', '/..%2fsecret.txt', '/ipdrecon/../../secret.txt', '/..%2fsite-two/index.html', '/..%5csecret.txt', '/%00', '/%', '/missing']) {
    const answer = await raw(path);
    assert.match(answer, /^HTTP\/1\.1 404 /, path);
    assert.ok(!answer.includes('secret'), path);
  }
});

test('a taken port gives the next free one', async () => {
  const second = await serve(join(folder, 'site'), server.port);
  assert.ok(second.port > server.port);
  assert.equal((await fetch(second.url)).status, 200);
  await second.close();
});

test('only reading is allowed', async () => {
  assert.equal((await fetch(server.url, { method: 'POST' })).status, 405);
});
