/**
 * The engine as an object: for people who bring their own page. Spawns the worker, turns its events into typed DOM events and
 * its answers into promises. Knows nothing of elements, layout or pointers.
 */
import { collect, DropError, type Droppable, type Dropped } from "./drop.js";
import type {
  DeviceChoice,
  Event as EngineEvent,
  FindingMessage,
  InputEvent,
  LookAt,
  MeshFormat,
  PlanSummary,
  Request,
  RunOptions,
  ViewOptions,
  WeightsAddress,
} from "./engine.js";
import { Deferred } from "./deferred.js";
import { Work } from "./work.js";
import type { FromWorker, ToWorker } from "./channel.js";

/** One of the engine's events by its name. */
export type EventOf<K extends EngineEvent["type"]> = Extract<EngineEvent, { type: K }>;

/** Where a reconstruction stands. */
export type State = "starting" | "idle" | "opening" | "planned" | "running" | "paused" | "finished" | "failed";

/** Every DOM event of a {@link Reconstructor}; `detail` is the engine's event. */
export type ReconstructorEventMap = { [K in EngineEvent["type"]]: CustomEvent<EventOf<K>> } & {
  state: CustomEvent<State>;
};

/** How to start. */
export interface ReconstructorOptions {
  /** Where to draw; left out, nothing is drawn. Its control is transferred, which cannot be undone. */
  canvas?: HTMLCanvasElement | OffscreenCanvas;
  /** Size of the canvas in physical pixels. */
  widthPx?: number;
  heightPx?: number;
  /** Physical pixels per CSS pixel. */
  pixelRatio?: number;
  /** `auto` takes WebGPU if it is there. */
  device?: DeviceChoice;
  /** Another place for the network's weights than beside the worker script, and what they must hash to. */
  weights?: WeightsAddress;
  /** Another place for the worker script, for hosts that move files. It must be of the page's own origin. */
  workerUrl?: string | URL;
}

/** Work could not go on. */
export class ReconstructionError extends Error {
  override readonly name = "ReconstructionError";
  constructor(
    /** `noWebgpu`, `scan`, `weights`, `memory`, `device`, `internal`, `export` or `disposed`. */
    readonly code: string,
    message: string,
    /** What to try. */
    readonly advice: string,
    /** What is wrong with the scan, file by file, if that is why. */
    readonly findings: readonly FindingMessage[] = [],
  ) {
    super(message);
  }
}

export interface Reconstructor {
  addEventListener<K extends keyof ReconstructorEventMap>(
    type: K,
    listener: (event: ReconstructorEventMap[K]) => void,
    options?: boolean | AddEventListenerOptions,
  ): void;
  addEventListener(
    type: string,
    listener: EventListenerOrEventListenerObject | null,
    options?: boolean | AddEventListenerOptions,
  ): void;
}

/** Failures after which the engine takes requests as before. */
const SURVIVED: ReadonlySet<string> = new Set(["scan", "weights", "export"]);

/** The sample room that is shown unless another is asked for. */
export const SAMPLE_SEED = 3;

/** One engine: opens a scan, runs it, exports its mesh. Its worker starts another for the run where the processor computes. */
export class Reconstructor extends EventTarget {
  /** Settles when the engine is up, or could not be started. */
  readonly ready: Promise<EventOf<"ready">>;
  readonly #worker: Worker;
  readonly #ready = new Deferred<EventOf<"ready">>();
  readonly #exports = new Map<number, Deferred<File>>();
  readonly #work = new Work();
  #plan?: Deferred<PlanSummary>;
  #run?: Deferred<EventOf<"finished">>;
  #lastPlan?: PlanSummary;
  #findings: FindingMessage[] = [];
  #state: State = "starting";
  #alive = true;
  #lastId = 0;

  constructor({ canvas, widthPx = 1, heightPx = 1, pixelRatio = 1, device = "auto", weights, workerUrl }: ReconstructorOptions = {}) {
    super();
    this.ready = this.#ready.promise;
    if (workerUrl !== undefined) {
      this.#worker = new Worker(workerUrl, { type: "module" });
    } else {
      // Bundlers find the worker by this literal; keep it as it is.
      this.#worker = new Worker(new URL("./worker.js", import.meta.url), { type: "module" });
    }
    this.#worker.onmessage = ({ data }: MessageEvent<FromWorker>) => this.#receive(data);
    this.#worker.onerror = (event) => {
      event.preventDefault();
      this.#fail("internal", `The worker script could not be run${event.message ? ` (${event.message})` : ""}.`, "Check the connection and reload the page.");
    };
    const offscreen = canvas && "transferControlToOffscreen" in canvas ? canvas.transferControlToOffscreen() : canvas;
    const request: Request = { type: "start", widthPx, heightPx, pixelRatio, device, weights };
    this.#send({ request, canvas: offscreen }, offscreen ? [offscreen] : []);
  }

  /** Where it stands. */
  get state(): State {
    return this.#state;
  }

  /** Whether the engine can still take requests; if not, make a new `Reconstructor`. */
  get alive(): boolean {
    return this.#alive;
  }

  /** What is known to be wrong with the scan that was opened last. */
  get findings(): readonly FindingMessage[] {
    return this.#findings;
  }

  /** The plan that {@link run} would run. */
  get plan(): PlanSummary | undefined {
    return this.#lastPlan;
  }

  /**
   * Opens a dropped or picked folder or .zip and plans its reconstruction. Call it in the `drop` handler itself: the browser
   * takes the dropped things back afterwards.
   */
  open(input: Droppable): Promise<PlanSummary> {
    return this.#openWith(collect(input));
  }

  /** Opens the sample room that is made by rule. */
  openSample(seed = SAMPLE_SEED): Promise<PlanSummary> {
    return this.#openWith(undefined, seed);
  }

  /**
   * Takes over from one that ended in the middle of its work, such as for a lost device: opens the same scan, with the same
   * weights and options, and goes on after the last stage that was finished. Settles with the plan; promises that the other gave
   * for its plan and its run are kept by this one.
   */
  async takeOver(lost: Reconstructor): Promise<PlanSummary> {
    const { toOpen, toRun } = lost.#work;
    if (toOpen.length === 0) throw nothingOpen();
    this.#run = lost.#run;
    const plan = (this.#plan = lost.#plan ?? new Deferred());
    lost.#plan = lost.#run = undefined;
    this.#findings = [];
    this.#enter("opening");
    for (const message of toOpen) this.#send(message);
    const planned = await plan.promise;
    for (const message of toRun) this.#send(message);
    if (toRun.length > 0) this.#enter("running");
    return planned;
  }

  /** Takes a file of weights for the network from now on. It is read in place, and told by `weights` or `failed`. */
  useWeights(file: File): void {
    this.#send({ request: { type: "useWeights" }, files: [file] });
  }

  /** Plans again with other options, without starting. What is left out stays as it was. */
  replan(options: Partial<RunOptions>): Promise<PlanSummary> {
    const known = this.#lastPlan;
    if (!known) return Promise.reject(nothingOpen());
    const plan = (this.#plan ??= new Deferred());
    this.request({ type: "replan", options: { ...known.options, ...options } });
    return plan.promise;
  }

  /** Runs the plan, or another with these options, to its end. */
  run(options: Partial<RunOptions> = {}): Promise<EventOf<"finished">> {
    const known = this.#lastPlan;
    if (!known) return Promise.reject(nothingOpen());
    this.#run ??= new Deferred();
    this.request({ type: "run", options: { ...known.options, ...options } });
    this.#enter("running");
    return this.#run.promise;
  }

  /** Holds after the current frame. */
  pause(): void {
    this.request({ type: "pause" });
  }

  /** Goes on. */
  resume(): void {
    this.request({ type: "resume" });
  }

  /** Stops. What was fused so far can be looked at and exported. */
  cancel(): void {
    this.request({ type: "cancel" });
  }

  /** The mesh as a file, in the scan's own frame unless `canonical` (metres, Z up) is asked for. */
  exportMesh(format: MeshFormat, { canonical = false } = {}): Promise<File> {
    return this.#ask((id) => ({ type: "export", id, format, canonical }));
  }

  /** The view as a PNG. */
  screenshot(): Promise<File> {
    return this.#ask((id) => ({ type: "screenshot", id }));
  }

  /** How the view is drawn. */
  view(view: ViewOptions): void {
    this.request({ type: "view", view });
  }

  /** Puts the camera somewhere. */
  look(at: LookAt): void {
    this.request({ type: "look", at });
  }

  /** Pointer, wheel, keys and size of the canvas. */
  input(input: InputEvent): void {
    this.request({ type: "input", input });
  }

  /** Any request of the protocol. */
  request(request: Request): void {
    this.#send({ request });
  }

  /** Ends the worker and frees everything it holds. Promises that are still open are rejected. */
  dispose(): void {
    this.#alive = false;
    this.#worker.terminate();
    this.#rejectAll(new ReconstructionError("disposed", "The reconstruction was closed.", "Open the scan again."));
  }

  async #openWith(gathering?: Promise<Dropped>, seed = 0): Promise<PlanSummary> {
    const plan = (this.#plan = new Deferred());
    this.#lastPlan = undefined;
    this.#findings = [];
    this.#enter("opening");
    if (!gathering) {
      this.request({ type: "openSample", seed });
      return plan.promise;
    }
    try {
      const dropped = await gathering;
      if (dropped.kind === "zip") {
        this.#send({ request: { type: "openZip" }, files: [dropped.file] });
      } else {
        this.#send({ request: { type: "openFolder", paths: dropped.paths.join("\n") }, files: dropped.files });
        this.#report(dropped.unreadable);
      }
    } catch (cause) {
      if (cause instanceof DropError) this.#report(cause.unreadable);
      const message = cause instanceof Error ? cause.message : String(cause);
      this.#fail("scan", message, cause instanceof DropError ? cause.advice : "Drop the folder again, or a .zip of it.");
    }
    return plan.promise;
  }

  /** What could not be read is a finding like those of the engine. */
  #report(unreadable: Extract<Dropped, { kind: "folder" }>["unreadable"]): void {
    for (const { path, reason } of unreadable) {
      this.#happen({
        type: "finding",
        finding: {
          severity: "warning",
          code: "unreadable",
          file: path,
          line: undefined,
          expected: "a file that the browser may read",
          found: reason,
          advice: "Check that it still exists and may be read, then drop the folder again.",
        },
      });
    }
  }

  #ask(make: (id: number) => Request): Promise<File> {
    const answer = new Deferred<File>();
    const id = ++this.#lastId;
    this.#exports.set(id, answer);
    this.request(make(id));
    return answer.promise;
  }

  #send(message: ToWorker, transfer: Transferable[] = []): void {
    if (!this.#alive) return;
    this.#work.asked(message);
    this.#worker.postMessage(message, transfer);
  }

  #receive({ event, payload }: FromWorker): void {
    if (event.type === "exported") {
      const answer = this.#exports.get(event.id);
      this.#exports.delete(event.id);
      answer?.resolve(new File(payload ? [payload] : [], event.fileName, { type: event.mime }));
    }
    this.#work.told(event, payload);
    this.#happen(event);
  }

  #fail(code: string, message: string, advice: string): void {
    this.#happen({ type: "failed", code, message, advice });
  }

  /** Takes an event into the state, tells the listeners, then settles promises: whoever awaits one sees the new state. */
  #happen(event: EngineEvent): void {
    switch (event.type) {
      case "ready":
        if (this.#state === "starting") this.#enter("idle");
        break;
      case "planned":
        this.#lastPlan = event.plan;
        if (this.#state !== "running" && this.#state !== "paused") this.#enter("planned");
        break;
      case "paused":
        this.#enter("paused");
        break;
      case "resumed":
        this.#enter("running");
        break;
      case "finished":
        this.#enter("finished");
        break;
      case "finding":
        this.#findings.push(event.finding);
        break;
      case "failed":
        if (!SURVIVED.has(event.code)) this.#alive = false;
        if (event.code !== "export") this.#enter("failed");
        break;
    }
    this.dispatchEvent(new CustomEvent(event.type, { detail: event }));
    this.#settle(event);
  }

  #settle(event: EngineEvent): void {
    if (event.type === "ready") {
      this.#ready.resolve(event);
    } else if (event.type === "planned") {
      this.#plan?.resolve(event.plan);
      this.#plan = undefined;
    } else if (event.type === "finished") {
      this.#run?.resolve(event);
      this.#run = undefined;
    } else if (event.type === "failed") {
      const error = new ReconstructionError(event.code, event.message, event.advice, this.#findings);
      if (event.code === "export") this.#rejectExports(error);
      else this.#rejectAll(error);
    }
  }

  #enter(state: State): void {
    if (this.#state === state) return;
    this.#state = state;
    this.dispatchEvent(new CustomEvent("state", { detail: state }));
  }

  #rejectAll(error: ReconstructionError): void {
    this.#ready.reject(error);
    this.#plan?.reject(error);
    this.#run?.reject(error);
    this.#plan = this.#run = undefined;
    this.#rejectExports(error);
  }

  #rejectExports(error: ReconstructionError): void {
    for (const answer of this.#exports.values()) answer.reject(error);
    this.#exports.clear();
  }
}

function nothingOpen(): ReconstructionError {
  return new ReconstructionError("scan", "No scan is open.", "Open a folder, a .zip or the sample first.");
}
