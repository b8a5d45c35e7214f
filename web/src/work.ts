/** What an engine was asked for and what its finished stages made: all that another engine needs to go on. */
import type { Event as EngineEvent, RunOptions, StageName } from "./engine.js";
import type { ToWorker } from "./channel.js";

const PAUSE: ToWorker = { request: { type: "pause" } };

export class Work {
  #weights?: ToWorker;
  #opening?: ToWorker;
  #running?: { message: ToWorker; options: string };
  readonly #kept = new Map<StageName, File>();
  #held = false;

  /** Remembers a message to the engine. What stages made is good for one scan, one set of options and one network. */
  asked(message: ToWorker): void {
    switch (message.request.type) {
      case "useWeights":
        this.#weights = message;
        this.#kept.clear();
        break;
      case "openFolder":
      case "openZip":
      case "openSample":
        this.#opening = message;
        this.#running = undefined;
        this.#kept.clear();
        break;
      case "run": {
        const options = sorted(message.request.options);
        if (this.#running?.options !== options) this.#kept.clear();
        this.#running = { message, options };
        break;
      }
    }
  }

  /** Remembers what the engine said, and the bytes beside it. */
  told(event: EngineEvent, payload?: Uint8Array<ArrayBuffer>): void {
    if (event.type === "kept" && payload) this.#kept.set(event.stage, new File([payload], event.stage));
    if (event.type === "finished" && event.cancelled) this.#running = undefined;
    if (event.type === "paused") this.#held = true;
    if (event.type === "resumed" || event.type === "finished") this.#held = false;
  }

  /** The messages after which another engine has the same scan open; none without a scan. */
  get toOpen(): ToWorker[] {
    return this.#opening ? [...(this.#weights ? [this.#weights] : []), this.#opening] : [];
  }

  /** The messages after which it goes on where this one was, or waits there if this one did, once the scan is open; none where nothing ran. */
  get toRun(): ToWorker[] {
    if (!this.#running) return [];
    const kept = [...this.#kept].map(([stage, file]): ToWorker => ({ request: { type: "keep", stage }, files: [file] }));
    return [...kept, this.#running.message, ...(this.#held ? [PAUSE] : [])];
  }
}

/** Options as a text that is the same for the same options. */
function sorted(options: RunOptions): string {
  return JSON.stringify(Object.entries(options).sort(([a], [b]) => (a < b ? -1 : 1)));
}
