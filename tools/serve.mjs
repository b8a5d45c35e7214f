// A static server for the built site, on this machine only. No special headers: the page must work on any static host.
import { createReadStream, statSync } from 'node:fs';
import { createServer } from 'node:http';
import { extname, join, normalize, sep } from 'node:path';
import { isMain, root } from './run.mjs';

const types = {
  '.html': 'text/html; charset=utf-8',
  '.css': 'text/css; charset=utf-8',
  '.js': 'text/javascript; charset=utf-8',
  '.mjs': 'text/javascript; charset=utf-8',
  '.json': 'application/json; charset=utf-8',
  '.map': 'application/json; charset=utf-8',
  '.ts': 'text/plain; charset=utf-8',
  '.txt': 'text/plain; charset=utf-8',
  '.wasm': 'application/wasm',
  '.svg': 'image/svg+xml',
  '.png': 'image/png',
  '.jpg': 'image/jpeg',
  '.webp': 'image/webp',
  '.ico': 'image/x-icon',
  '.woff2': 'font/woff2',
  '.webmanifest': 'application/manifest+json',
  '.zip': 'application/zip',
  '.ply': 'application/octet-stream',
  '.glb': 'model/gltf-binary',
};

/** The file that a request's path names inside `folder`, or null where it names none or would leave the folder. */
function file(folder, url) {
  let path;
  try {
    path = decodeURIComponent(new URL(url, 'http://localhost').pathname);
  } catch {
    return null;
  }
  if (path.includes('\0')) return null;
  let full = normalize(join(folder, path));
  if (full !== folder && !full.startsWith(folder + sep)) return null;
  let stat = statSync(full, { throwIfNoEntry: false });
  if (stat?.isDirectory()) {
    full = join(full, 'index.html');
    stat = statSync(full, { throwIfNoEntry: false });
  }
  return stat?.isFile() ? { full, size: stat.size } : null;
}

/**
 * Serves a folder on 127.0.0.1. Takes `port` or the next free one (0: any free one); gives the address and a way to end it.
 * @param {string} folder @param {number} port
 * @returns {Promise<{ url: string, port: number, close: () => Promise<void> }>}
 */
export async function serve(folder, port = 8080) {
  const base = normalize(folder).replace(/[\\/]+$/, '');
  const server = createServer((request, response) => {
    if (request.method !== 'GET' && request.method !== 'HEAD') {
      response.writeHead(405, { allow: 'GET, HEAD' }).end();
      return;
    }
    const found = file(base, request.url ?? '/');
    if (!found) {
      response.writeHead(404, { 'content-type': 'text/plain; charset=utf-8' }).end('Not found\n');
      return;
    }
    response.writeHead(200, {
      'content-type': types[extname(found.full).toLowerCase()] ?? 'application/octet-stream',
      'content-length': found.size,
      'cache-control': 'no-cache',
    });
    if (request.method === 'HEAD') response.end();
    else createReadStream(found.full).on('error', () => response.destroy()).pipe(response);
  });
  const listen = (wanted) => new Promise((resolve, reject) => {
    server.once('error', reject).listen(wanted, '127.0.0.1', () => {
      server.off('error', reject);
      resolve(undefined);
    });
  });
  for (let wanted = port; ; wanted += 1) {
    try {
      await listen(wanted);
      break;
    } catch (error) {
      if (error.code !== 'EADDRINUSE' || wanted >= port + 100) throw error;
    }
  }
  const { port: taken } = /** @type {import('node:net').AddressInfo} */ (server.address());
  const close = () => new Promise((resolve) => {
    server.close(() => resolve(undefined));
    server.closeAllConnections();
  });
  return { url: `http://127.0.0.1:${taken}/`, port: taken, close };
}

if (isMain(import.meta.url)) {
  const { url } = await serve(join(root, 'www/dist'));
  console.log(`serve   ${url}`);
}
