/** What page, worker and the run's worker post to each other: the engine's messages, and the binary things that travel beside them. */
import type { Drawing, Event, Request } from "./engine.js";

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

/** To the run's worker: what the page asks for, with the compiled engine beside the first, or where the visitor stands. */
export type ToRunner = (ToWorker & { module?: WebAssembly.Module }) | { eye: readonly [number, number, number] };

/** From the run's worker: what the page is told, or what is to be drawn. */
export type FromRunner = FromWorker | { drawing: Drawing; vertices?: Float32Array<ArrayBuffer> };
