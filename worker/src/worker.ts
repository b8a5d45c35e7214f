/**
 * The module worker: loads the engine, hands it messages and hands its events on. It queues what comes before the engine
 * is up, and it turns a crash of the engine into one sentence for the visitor instead of a page that stands still.
 */
import init, { Engine } from "./engine.js";
import type { Event, Request } from "./engine.js";
import { download, missing, type Progress } from "./download.js";
import { released } from "./released.js";

/** From the page to the worker: a request, and the binary things that travel beside it. */
export interface ToWorker {
  request: Request;
  /** Beside `start`; without it the engine computes and shows nothing. */
  canvas?: OffscreenCanvas;
  /** Beside `openFolder` (one for each path, in the same order), `openZip` and `useWeights`. */
  files?: File[];
}

/** From the worker to the page: an event, and the bytes of an exported file beside it. */
export interface FromWorker {
  event: Event;
  payload?: Uint8Array<ArrayBuffer>;
}

const scope = self as unknown as DedicatedWorkerGlobalScope;
const waiting: ToWorker[] = [];
let engine: Engine | undefined;
/** Files that are read together. */
const READS_AT_ONCE = 256;
/** Scans that were to be opened so far. */
let opened = 0;
let started = false;
let dead = false;
/** Bytes of weights that the network still has to wait for, as far as known. */
let toFetch: number | undefined;

scope.onmessage = ({ data }: MessageEvent<ToWorker>) => {
  if (data.request.type === "start" && !started) {
    started = true;
    void start(data);
  } else if (engine) {
    void receive(engine, data);
  } else {
    waiting.push(data);
  }
};

// A panic inside one of the engine's own tasks reaches nobody's `catch`: it ends here.
scope.addEventListener("error", (event) => {
  event.preventDefault();
  die(event.error ?? event.message);
});
scope.addEventListener("unhandledrejection", (event) => die(event.reason));

async function start({ request, canvas }: ToWorker): Promise<void> {
  try {
    await init({ module_or_path: new URL("./engine_bg.wasm", import.meta.url) });
  } catch (cause) {
    die(cause, "The engine could not be loaded", "Check the connection and reload the page.");
    return;
  }
  try {
    const weights = (request.type === "start" && request.weights) || { ...released, url: new URL(released.url, import.meta.url).href };
    const looked = missing(weights).then((bytes) => void (toFetch = bytes), () => undefined);
    const bring = async (progress: Progress): Promise<Blob> => {
      const file = await download(weights, progress, warn);
      toFetch = 0;
      return file;
    };
    const up = await Engine.start(canvas, request, emit, bring);
    // The first plan says what has to be fetched.
    await looked;
    engine = up;
    for (const message of waiting.splice(0)) void receive(up, message);
  } catch (cause) {
    die(cause, "The engine could not be started");
  }
}

/** Hands a message on; of a folder the texts are read first, unless another scan is opened meanwhile. */
async function receive(to: Engine, message: ToWorker): Promise<void> {
  const { request, files = [] } = message;
  if (request.type.startsWith("open")) opened += 1;
  if (request.type !== "openFolder") return deliver(to, message, []);
  const mine = opened;
  const texts = await textsOf(files);
  if (mine === opened) deliver(to, message, texts);
}

/**
 * The contents of the text files among `files`, at their places. A scan of 5,000 frames has as many poses: read together they
 * take a fraction of the time that one after the other takes. What cannot be read stays empty, and the engine says why.
 */
async function textsOf(files: readonly File[]): Promise<(string | undefined)[]> {
  const texts: (string | undefined)[] = new Array(files.length).fill(undefined);
  const places = [...files.keys()].filter((place) => files[place]?.name.endsWith(".txt"));
  for (let i = 0; i < places.length; i += READS_AT_ONCE) {
    const part = places.slice(i, i + READS_AT_ONCE);
    await Promise.all(part.map(async (place) => (texts[place] = await files[place]?.text().catch(() => undefined))));
  }
  return texts;
}

function deliver(to: Engine, { request, files }: ToWorker, texts: (string | undefined)[]): void {
  if (dead) return;
  try {
    to.handle(request, files ?? [], texts);
  } catch (cause) {
    die(cause);
  }
}

function emit(event: Event, payload?: Uint8Array): void {
  if (dead) return;
  // What the engine says about its own end is better than what could be said here about the trap that follows it.
  dead = event.type === "failed" && (event.code === "internal" || !engine);
  if (event.type === "weights") toFetch = 0;
  if (event.type === "planned" && event.plan.depth === "network") event.plan.downloadBytes = toFetch;
  const bytes = payload as Uint8Array<ArrayBuffer> | undefined;
  const message: FromWorker = { event, payload: bytes };
  scope.postMessage(message, bytes ? [bytes.buffer] : []);
}

/** What went wrong with the weights without stopping anything. */
function warn(expected: string, found: string, advice: string): void {
  emit({ type: "finding", finding: { severity: "warning", code: "weights", file: undefined, line: undefined, expected, found, advice } });
}

function die(
  cause: unknown,
  what = "The engine stopped because of an error of its own",
  advice = "Start again. If it happens once more, a coarser voxel size or fewer frames may get through.",
): void {
  emit({ type: "failed", code: "internal", message: `${what} (${reason(cause)}).`, advice });
}

function reason(cause: unknown): string {
  const text = cause instanceof Error ? `${cause.name}: ${cause.message}` : String(cause);
  return text.replace(/[.\s]+$/, "");
}
