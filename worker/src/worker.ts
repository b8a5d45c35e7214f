/**
 * The module worker: loads the engine, hands it messages and hands its events on. It queues what comes before the engine
 * is up, and it turns a crash of the engine into one sentence for the visitor instead of a page that stands still. Where the processor
 * computes, it draws alone and starts the same script once more as a {@link Runner}.
 */
import type { FromRunner, FromWorker, ToRunner, ToWorker } from "./channel.js";
import init, { Engine } from "./engine.js";
import type { Drawing, Event, Request } from "./engine.js";
import { download, missing, type Progress } from "./download.js";
import { released } from "./released.js";
import { Runner } from "./runner.js";

const scope = self as unknown as DedicatedWorkerGlobalScope;
const waiting: ToWorker[] = [];
let engine: Engine | undefined;
/** Where the work is done, if not here. */
let runner: Runner | undefined;
/** What the view alone answers. */
const SHOWN: ReadonlySet<Request["type"]> = new Set(["input", "view", "look", "screenshot"]);
/** Files that are read together. */
const READS_AT_ONCE = 256;
/** Scans that were to be opened so far. */
let opened = 0;
let started = false;
let dead = false;
/** Bytes of weights that the network still has to wait for, as far as known. */
let toFetch: number | undefined;

scope.onmessage = ({ data }: MessageEvent<ToWorker | ToRunner>) => {
  if ("eye" in data) {
    engine?.stand(...data.eye);
  } else if (data.request.type === "start" && !started) {
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

async function start({ request, canvas, ...beside }: ToWorker & { module?: WebAssembly.Module }): Promise<void> {
  let module = beside.module;
  try {
    module ??= await compile();
    await init({ module_or_path: module });
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
    const up = await Engine.start(canvas, request, emit, bring, beside.module ? draw : undefined);
    if (canvas && !up.computes) runner = new Runner(up, request, module, relay, die);
    // The first plan says what has to be fetched.
    else await looked;
    engine = up;
    for (const message of waiting.splice(0)) void receive(up, message);
  } catch (cause) {
    die(cause, "The engine could not be started");
  }
}

/** The engine's code; also from a host that does not call it `application/wasm`. */
async function compile(): Promise<WebAssembly.Module> {
  const answer = await fetch(new URL("./engine_bg.wasm", import.meta.url));
  if (!answer.ok) throw new Error(`${answer.url} answers ${answer.status} ${answer.statusText}`.trim());
  const streams = answer.headers.get("content-type")?.startsWith("application/wasm");
  return streams ? WebAssembly.compileStreaming(answer) : WebAssembly.compile(await answer.arrayBuffer());
}

/** Hands a message on; of a folder the texts are read first, unless another scan is opened meanwhile. */
async function receive(to: Engine, message: ToWorker): Promise<void> {
  const { request, files = [] } = message;
  if (runner && !SHOWN.has(request.type)) return runner.send(message);
  if (request.type === "input" || request.type === "look") runner?.lookAgain();
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
  if (event.type === "weights") toFetch = 0;
  if (event.type === "planned" && event.plan.depth === "network") event.plan.downloadBytes = toFetch;
  relay({ event, payload: payload as Uint8Array<ArrayBuffer> | undefined });
}

/** Hands an event to who listens. */
function relay(message: FromWorker): void {
  if (dead) return;
  const { event, payload } = message;
  // What the engine says about its own end is better than what could be said here about the trap that follows it.
  dead = event.type === "failed" && (event.code === "internal" || !engine);
  scope.postMessage(message, payload ? [payload.buffer] : []);
}

/** Hands what is to be drawn to the worker that has the canvas. */
function draw(drawing: Drawing, vertices?: Float32Array<ArrayBuffer>): void {
  const message: FromRunner = { drawing, vertices };
  if (!dead) scope.postMessage(message, vertices ? [vertices.buffer] : []);
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
