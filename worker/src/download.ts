/**
 * The network's weights: out of the browser's cache if they are there, otherwise fetched, checked and kept. A cache that
 * fails costs the next visitor a download and nothing else.
 */
import type { WeightsAddress } from "./engine.js";

/** Told the bytes that are there and those there will be. */
export type Progress = (done: number, total: number) => void;
/** Told what went wrong without stopping anything: what was expected, what was found, what to do. */
export type Warn = (expected: string, found: string, advice: string) => void;

const CACHE = "ipdrecon-weights";
const TRY_AGAIN = "check the connection and start again, or give a file of weights, or estimate depth from the photos alone, which needs none";

/** The file at `address`, whole and as its hash says. Its errors read `what happened; what to do`. */
export async function download({ url, sha256 }: WeightsAddress, progress: Progress, warn: Warn): Promise<Blob> {
  const key = sha256 === undefined ? undefined : entry(url, sha256);
  const kept = key === undefined ? undefined : await recall(key, warn);
  if (kept && (await hash(kept)) === sha256) {
    progress(kept.size, kept.size);
    return kept;
  }
  const blob = await fetchAll(url, progress);
  const found = await hash(blob);
  if (sha256 !== undefined && found === undefined) {
    warn("a page that came by https, where a browser can check the weights", "one that did not", "Serve the page by https.");
  } else if (sha256 !== undefined && found !== sha256) {
    throw new Error(`Expected weights with the hash ${short(sha256)} at ${url}, found ${blob.size} bytes with ${short(found ?? "")}; the file was changed or damaged on its way: ${TRY_AGAIN}`);
  }
  if (key !== undefined) await keep(key, blob, warn);
  return blob;
}

/** Bytes that {@link download} will fetch: 0 where the file is kept, nothing where its size is not known. */
export async function missing({ url, sha256, bytes }: WeightsAddress & { bytes?: number }): Promise<number | undefined> {
  const kept = sha256 === undefined ? undefined : await recall(entry(url, sha256), () => undefined);
  return kept ? 0 : bytes;
}

/** The key of a file in the cache: one that was published anew under the same name is another entry. */
const entry = (url: string, sha256: string): string => `${url}#${sha256}`;

async function fetchAll(url: string, progress: Progress): Promise<Blob> {
  const unreachable = (why: string): Error => new Error(`Expected the network's weights at ${url}, found ${why}; ${TRY_AGAIN}`);
  const response = await fetch(url).catch((cause: unknown) => {
    throw unreachable(cause instanceof Error ? cause.message : "no answer");
  });
  if (!response.ok || !response.body) throw unreachable(`the answer ${response.status} ${response.statusText}`.trim());
  // With a compressed transfer the length told is not that of the file.
  const encoded = response.headers.get("content-encoding");
  const told = encoded ? 0 : Number(response.headers.get("content-length"));
  const parts: BlobPart[] = [];
  let done = 0;
  const reader = response.body.getReader();
  for (;;) {
    const { done: ended, value } = await reader.read().catch((cause: unknown) => {
      throw unreachable(`${done} bytes before the connection ended (${String(cause)})`);
    });
    if (ended) break;
    parts.push(value);
    done += value.byteLength;
    progress(done, Math.max(told, done));
  }
  if (told > 0 && done < told) throw unreachable(`${done} of ${told} bytes`);
  return new Blob(parts);
}

/** In hexadecimal; nothing where the browser does not compute hashes, which it does for pages that came by https. */
async function hash(blob: Blob): Promise<string | undefined> {
  if (!("subtle" in crypto)) return undefined;
  const digest = new Uint8Array(await crypto.subtle.digest("SHA-256", await blob.arrayBuffer()));
  return Array.from(digest, (byte) => byte.toString(16).padStart(2, "0")).join("");
}

/** What a cache holds under a key; nothing where there is none. */
async function recall(key: string, warn: Warn): Promise<Blob | undefined> {
  try {
    return await (await (await caches.open(CACHE)).match(name(key)))?.blob();
  } catch (cause) {
    cacheFails(cause, warn);
    return undefined;
  }
}

async function keep(key: string, blob: Blob, warn: Warn): Promise<void> {
  try {
    const cache = await caches.open(CACHE);
    // One file is in use: older ones would only take the visitor's room.
    for (const old of await cache.keys()) await cache.delete(old);
    await cache.put(name(key), new Response(blob));
  } catch (cause) {
    cacheFails(cause, warn);
  }
}

/** Caches leave out what follows a hash sign. */
function name(key: string): string {
  return key.replace("#", `${key.includes("?") ? "&" : "?"}sha256=`);
}

function cacheFails(cause: unknown, warn: Warn): void {
  warn("a browser that keeps the weights for the next time", cause instanceof Error ? cause.message : String(cause), "They are fetched again each time. Private windows and full disks do this.");
}

function short(sha256: string): string {
  return `${sha256.slice(0, 12)}…`;
}
