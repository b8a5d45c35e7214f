/**
 * `<ipd-recon>`: the whole reconstruction as one element. It owns the canvas and the worker, takes drops, forwards hands and
 * keys, speaks to screen readers, and tells the page everything by DOM events. Panels and buttons are the page's own.
 */
import { ReconstructionError, Reconstructor, type EventOf, type State } from "./client.js";
import { weightsOf, type Droppable } from "./drop.js";
import type { DeviceChoice, Event as EngineEvent, FindingMessage, LookAt, MeshFormat, PlanSummary, PresetName, RunOptions, ShadingMode, WeightsAddress } from "./engine.js";
import { forwardInput, pixelSize } from "./input.js";
import { preflight } from "./preflight.js";
import { Announcer } from "./announcer.js";
import { skeleton } from "./skeleton.js";

/** Every DOM event of the element: the engine's own under `ipd-…`, and `ipd-state`. They bubble out of shadow roots. */
export type IpdReconEventMap = { [K in EngineEvent["type"] as `ipd-${K}`]: CustomEvent<EventOf<K>> } & {
  "ipd-state": CustomEvent<State>;
};

/** How to open. */
export interface OpenOptions {
  /** Run the plan at once; otherwise wait for {@link IpdReconElement.run}. By default as the `review` attribute says. */
  autostart?: boolean;
}

const FORWARDED: readonly EngineEvent["type"][] = [
  "ready", "opened", "weights", "planned", "stage", "progress", "bricks", "paused", "resumed", "finished", "finding", "failed",
  "kept", "exported", "cameraChanged",
];
/** Failures of the engine itself, after which another can go on. */
const LOST: ReadonlySet<string> = new Set(["device", "internal"]);
/** After the last of these the processor goes on, which cannot be lost. */
const MOST_LOSSES = 2;
const DEVICES: readonly DeviceChoice[] = ["auto", "cpu", "gpu"];
const PRESETS: readonly PresetName[] = ["small", "medium", "full"];
const SHADINGS: readonly ShadingMode[] = ["color", "normal", "wireframe", "depth", "confidence", "views"];

export interface IpdReconElement {
  addEventListener<K extends keyof (IpdReconEventMap & HTMLElementEventMap)>(
    type: K,
    listener: (event: (IpdReconEventMap & HTMLElementEventMap)[K]) => void,
    options?: boolean | AddEventListenerOptions,
  ): void;
  addEventListener(type: string, listener: EventListenerOrEventListenerObject | null, options?: boolean | AddEventListenerOptions): void;
}

/**
 * Attributes: `theme` (`light`, `dark`; otherwise the system's), `shading` (`color`, `normal`, `wireframe`, `depth`, `confidence`, `views`), `cameras`,
 * `back-faces`, `review` (wait after the plan), `voxel-size` and `max-depth` (metres), `every` (n-th keyframe), `views` (so many
 * keyframes, spread evenly), `depth` (`sensor`, `stereo`, `network`; otherwise what the scan has), `stereo-size` (`320x240`), `preset` (of the
 * network: `small`, `medium`, `full`), `label` (what screen readers call it); and, read when it is put into the page, `device`
 * (`cpu`; `gpu`, which uses even an adapter that is software), `weights` and `weights-sha256` (another file for the network, and its hash) and `worker-src`.
 */
export class IpdReconElement extends HTMLElement {
  static readonly observedAttributes = ["theme", "shading", "cameras", "back-faces", "label"];

  readonly #parts = skeleton(this.attachShadow({ mode: "open" }));
  readonly #announcer = new Announcer(this.#parts.status, this.#parts.caption);
  readonly #dark = matchMedia("(prefers-color-scheme: dark)");
  readonly #still = matchMedia("(prefers-reduced-motion: reduce)");
  #client?: Reconstructor;
  #canvas?: HTMLCanvasElement;
  #connection?: AbortController;
  #state: State = "starting";
  /** Engines that were lost in the middle of the scan that is open. */
  #losses = 0;
  /** It was the hidden page that held the run, not the visitor. */
  #heldByHiding = false;

  /** The engine behind the element, for everything that has no method here. Replaced by {@link restart}. */
  get reconstructor(): Reconstructor | undefined {
    return this.#client;
  }

  /** Where the reconstruction stands. */
  get state(): State {
    return this.#state;
  }

  connectedCallback(): void {
    this.restart();
  }

  disconnectedCallback(): void {
    this.#stop();
  }

  attributeChangedCallback(): void {
    this.#label();
    this.#view();
  }

  /** Puts a new engine and a new canvas in the place of the old ones. Everything not exported is gone. */
  restart(): void {
    this.#stop();
    this.#losses = 0;
    this.#start(this.#device());
  }

  #start(device: DeviceChoice): void {
    const signal = (this.#connection = new AbortController()).signal;
    const [shortcoming] = preflight();
    if (shortcoming) {
      this.#enter("failed");
      this.#tell({ type: "failed", code: shortcoming.code, message: shortcoming.message, advice: shortcoming.advice });
      return;
    }
    // Control over a canvas is given away once and for all, so each engine gets a canvas of its own.
    const canvas = (this.#canvas = document.createElement("canvas"));
    canvas.tabIndex = 0;
    canvas.setAttribute("part", "canvas");
    canvas.setAttribute("role", "application");
    this.#label();
    this.#parts.stage.replaceChildren(canvas);
    this.#enter("starting");
    const client = (this.#client = new Reconstructor({
      canvas,
      ...pixelSize(canvas),
      device,
      weights: this.#weights(),
      workerUrl: this.getAttribute("worker-src") ?? undefined,
    }));
    for (const type of FORWARDED) client.addEventListener(type, (event) => this.#take((event as CustomEvent<EngineEvent>).detail), { signal });
    // A failure comes as an event right after: it may be one that is survived.
    client.addEventListener("state", ({ detail }) => void (detail !== "failed" && this.#enter(detail)), { signal });
    this.#view();
    forwardInput(canvas, (input) => client.input(input), () => this.#showsSomething(), signal);
    this.#takeDrops(signal);
    this.#dark.addEventListener("change", () => this.#view(), { signal });
    this.#still.addEventListener("change", () => this.#view(), { signal });
    document.addEventListener("visibilitychange", () => this.#hide(document.hidden), { signal });
  }

  /**
   * Opens a dropped or picked folder or .zip, plans, and runs the plan unless told to wait. Call it in the event's handler
   * itself. Settles with the plan. A single .safetensors file is taken as the network's weights, for the next run.
   */
  open(input: Droppable, options?: OpenOptions): Promise<PlanSummary> {
    const weights = weightsOf(input);
    if (weights) return this.#takeWeights(weights);
    return this.#begin((client) => client.open(input), options);
  }

  /** Opens the sample room that is made by rule. */
  openSample(seed?: number, options?: OpenOptions): Promise<PlanSummary> {
    return this.#begin((client) => client.openSample(seed), options);
  }

  /** Takes a file of weights for the network, from the next run on. */
  useWeights(file: File): void {
    this.#engine().useWeights(file);
  }

  /** Plans again with other options. */
  replan(options: Partial<RunOptions> = {}): Promise<PlanSummary> {
    return this.#engine().replan({ ...this.#options(), ...options });
  }

  /** Runs the plan to its end. */
  run(options: Partial<RunOptions> = {}): Promise<EventOf<"finished">> {
    return this.#engine().run({ ...this.#options(), ...options });
  }

  /** Holds after the current frame. */
  pause(): void {
    this.#client?.pause();
  }

  /** Goes on. */
  resume(): void {
    this.#client?.resume();
  }

  /** Stops; what is there stays. */
  cancel(): void {
    this.#client?.cancel();
  }

  /** The mesh as a file. */
  exportMesh(format: MeshFormat, options?: { canonical?: boolean }): Promise<File> {
    return this.#engine().exportMesh(format, options);
  }

  /** The view as a PNG. */
  screenshot(): Promise<File> {
    return this.#engine().screenshot();
  }

  /** Puts the camera somewhere. */
  look(at: LookAt): void {
    this.#client?.look(at);
  }

  override focus(options?: FocusOptions): void {
    this.#canvas?.focus(options);
  }

  async #begin(open: (client: Reconstructor) => Promise<PlanSummary>, { autostart = !this.hasAttribute("review") }: OpenOptions = {}): Promise<PlanSummary> {
    // A scan may be dropped at any time: an engine that is at work, or that has ended, gives way to a fresh one.
    if (!this.#client?.alive || ["opening", "running", "paused"].includes(this.#state)) this.restart();
    const client = this.#engine();
    let plan = await open(client);
    const wished = this.#options();
    if (Object.keys(wished).length > 0) plan = await client.replan(wished);
    if (autostart) client.run().catch(() => undefined);
    return plan;
  }

  /** The plan that is there stays: weights change what a run makes, not what it does. */
  async #takeWeights(read: () => Promise<File>): Promise<PlanSummary> {
    const client = this.#engine();
    client.useWeights(await read());
    return client.plan ?? Promise.reject(new ReconstructionError("scan", "The weights are taken; no scan is open.", "Drop a scan."));
  }

  /** Where the attributes say to work. */
  #device(): DeviceChoice {
    return DEVICES.find((device) => device === this.getAttribute("device")) ?? "auto";
  }

  /** Where the attributes say that weights lie. */
  #weights(): WeightsAddress | undefined {
    const address = this.getAttribute("weights");
    if (address === null) return undefined;
    return { url: new URL(address, document.baseURI).href, sha256: this.getAttribute("weights-sha256")?.toLowerCase() };
  }

  /** What the attributes ask for. */
  #options(): Partial<RunOptions> {
    const number = (name: string): number | undefined => {
      const value = Number.parseFloat(this.getAttribute(name) ?? "");
      return value > 0 ? value : undefined;
    };
    const depth = this.getAttribute("depth");
    const [, width, height] = /^(\d+)x(\d+)$/.exec(this.getAttribute("stereo-size") ?? "") ?? [];
    const all: Partial<RunOptions> = {
      voxelSizeM: number("voxel-size"),
      every: number("every"),
      views: number("views"),
      maxDepthM: number("max-depth"),
      depth: depth === "sensor" || depth === "stereo" || depth === "network" ? depth : undefined,
      preset: PRESETS.find((preset) => preset === this.getAttribute("preset")),
      stereoSize: width && height ? { widthPx: Number(width), heightPx: Number(height) } : undefined,
    };
    return Object.fromEntries(Object.entries(all).filter(([, value]) => value !== undefined));
  }

  #engine(): Reconstructor {
    if (this.#client) return this.#client;
    throw new ReconstructionError("disposed", "The element is not in a page, or the browser cannot run the engine.", "Put it into the page first.");
  }

  #stop(): void {
    this.#client?.dispose();
    this.#detach();
  }

  /** Lets go of an engine and its canvas. */
  #detach(): void {
    this.#connection?.abort();
    this.#canvas?.remove();
    this.#client = this.#canvas = this.#connection = undefined;
  }

  #take(event: EngineEvent): void {
    if (event.type !== "failed") return this.#tell(event);
    if (LOST.has(event.code) && this.#goOn(event)) return;
    if (event.code !== "export") this.#enter("failed");
    this.#tell(event);
  }

  /** Lets another engine go on with the work of one that was lost; the processor takes it where graphics devices fail again. */
  #goOn({ message }: EventOf<"failed">): boolean {
    const lost = this.#client;
    if (!lost || !["running", "paused", "finished"].includes(this.#state) || this.#losses === MOST_LOSSES) return false;
    const device = this.#losses === 0 ? this.#device() : "cpu";
    this.#losses += 1;
    this.#detach();
    this.#start(device);
    this.#engine().takeOver(lost).then(() => this.#tellLoss(message), () => undefined);
    lost.dispose();
    return true;
  }

  #tellLoss(found: string): void {
    const expected = "a graphics device that lasts for the whole run";
    const advice = "The run goes on after the last stage that was finished. If it happens again, close what else uses the graphics card, or choose a smaller preset or larger voxels.";
    const finding: FindingMessage = { severity: "warning", code: "device-lost", file: undefined, line: undefined, expected, found, advice };
    this.#tell({ type: "finding", finding });
    this.#hide(document.hidden);
  }

  #tell(event: EngineEvent): void {
    this.#announcer.take(event);
    this.dispatchEvent(new CustomEvent(`ipd-${event.type}`, { detail: event, bubbles: true, composed: true }));
  }

  #enter(state: State): void {
    if (this.#state === state) return;
    this.#state = state;
    this.#parts.stage.classList.toggle("live", this.#showsSomething());
    this.#parts.empty.hidden = this.#showsSomething() || state === "failed";
    this.dispatchEvent(new CustomEvent("ipd-state", { detail: state, bubbles: true, composed: true }));
  }

  #showsSomething(): boolean {
    return this.#state === "running" || this.#state === "paused" || this.#state === "finished";
  }

  /** A page that nobody sees leaves the machine to those that somebody does. */
  #hide(hidden: boolean): void {
    if (hidden && this.#state === "running") {
      this.#heldByHiding = true;
      this.pause();
    } else if (!hidden && this.#heldByHiding) {
      this.#heldByHiding = false;
      this.resume();
    }
  }

  #label(): void {
    const label = this.getAttribute("label") ?? "3D view of the room. Drag or arrow keys turn it, W A S D fly, plus and minus zoom, Home shows everything.";
    this.#canvas?.setAttribute("aria-label", label);
  }

  #view(): void {
    const theme = this.getAttribute("theme");
    const shading = this.getAttribute("shading") as ShadingMode;
    this.#client?.view({
      shading: SHADINGS.includes(shading) ? shading : "color",
      cameras: this.hasAttribute("cameras"),
      backFaces: this.hasAttribute("back-faces"),
      dark: theme === "dark" || (theme !== "light" && this.#dark.matches),
      reducedMotion: this.#still.matches,
    });
  }

  #takeDrops(signal: AbortSignal): void {
    const hover = (on: boolean): void => void this.#parts.stage.classList.toggle("drop", on);
    this.addEventListener("dragover", (event) => {
      event.preventDefault();
      hover(true);
    }, { signal });
    this.addEventListener("dragleave", () => hover(false), { signal });
    this.addEventListener("drop", (event) => {
      event.preventDefault();
      hover(false);
      // Failures are told as events; nobody awaits this promise.
      if (event.dataTransfer) this.open(event.dataTransfer).catch(() => undefined);
    }, { signal });
  }
}

/** Defines the element, under another name where two versions live in one page. */
export function defineIpdRecon(name = "ipd-recon"): void {
  // A class can carry one name only: each name gets a class of its own.
  if (!customElements.get(name)) customElements.define(name, class extends IpdReconElement {});
}

declare global {
  interface HTMLElementTagNameMap {
    "ipd-recon": IpdReconElement;
  }
}
