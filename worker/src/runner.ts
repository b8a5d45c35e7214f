/**
 * The engine's work in a worker of its own, where the processor does it: a step may take seconds, and the view answers the hand all the
 * while. The bricks come as bytes and are drawn by the worker that has the canvas.
 */
import type { FromRunner, FromWorker, ToRunner, ToWorker } from "./channel.js";
import type { Drawing, Engine, Request } from "./engine.js";

/** How long after a movement the run is told of it. */
const LOOK_MS = 100;

export class Runner {
  readonly #worker: Worker;
  readonly #view: Engine;
  #looking = false;

  /** `relay` takes the page's events, `die` what ended the work. */
  constructor(view: Engine, start: Request, module: WebAssembly.Module, relay: (message: FromWorker) => void, die: (cause: unknown) => void) {
    this.#view = view;
    // This script once more, wherever a bundler has put it.
    this.#worker = new Worker(self.location.href, { type: "module", name: "ipdrecon run" });
    this.#worker.onmessage = ({ data }: MessageEvent<FromRunner>) => {
      try {
        if ("drawing" in data) this.#draw(data.drawing, data.vertices);
        else if (data.event.type !== "ready") relay(data);
      } catch (cause) {
        die(cause);
      }
    };
    this.#worker.onerror = (event) => {
      event.preventDefault();
      die(event.message || "the worker for the run could not be started");
    };
    this.#post({ request: { ...start, device: "cpu" } as Request, module });
  }

  /** Hands on what the page asks for. */
  send(message: ToWorker): void {
    this.#post(message);
  }

  /** Tells the run, soon, where the visitor stands: it hands over what is near them first. */
  lookAgain(): void {
    if (this.#looking) return;
    this.#looking = true;
    setTimeout(() => {
      this.#looking = false;
      const [x, y, z] = this.#view.eye ?? [];
      if (x !== undefined && y !== undefined && z !== undefined) this.#post({ eye: [x, y, z] });
    }, LOOK_MS);
  }

  #draw(drawing: Drawing, vertices?: Float32Array): void {
    this.#view.draw(drawing, vertices);
    this.lookAgain();
  }

  #post(message: ToRunner): void {
    this.#worker.postMessage(message);
  }
}
