/** Says what goes on: every change to the eye, and to the ear only as often as one can listen. */
import type { Event as EngineEvent, PlanSummary, StageName } from "./engine.js";
import { amount, count, counted, stageTitle } from "./words.js";

/** Progress is spoken at each of these shares of the work. */
const SPOKEN_SHARE = 0.25;

/** Turns events into the caption and into the words of the one `role="status"`. */
export class Announcer {
  #stage: StageName = "opening";
  #spoken = 0;

  constructor(
    readonly status: HTMLElement,
    readonly caption: HTMLElement,
  ) {}

  /** Takes one event of the engine. */
  take(event: EngineEvent): void {
    switch (event.type) {
      case "opened":
        this.#both(`Opened ${event.name}: ${event.format}, ${counted(event.frames, "frame")}.`);
        break;
      case "planned":
        this.#both(planned(event.plan));
        break;
      case "weights":
        this.#both(`The weights ${event.name} are in use.`);
        break;
      case "stage":
        this.#stage = event.stage;
        this.#spoken = 0;
        this.#both(`${stageTitle(event.stage)}…`);
        break;
      case "progress":
        this.#progress(event.done, event.total, event.triangles);
        break;
      case "paused":
        this.#both("Paused.");
        break;
      case "resumed":
        this.#both("Going on.");
        break;
      case "finished": {
        const how = event.cancelled ? "Stopped" : "Finished";
        this.#both(`${how}: ${counted(event.triangles, "triangle")} from ${counted(event.frames, "frame")}.`);
        break;
      }
      case "failed":
        this.#both(`${event.message} ${event.advice}`);
        break;
      case "finding":
        if (event.finding.code === "device-lost") this.#both(`${event.finding.found} ${event.finding.advice}`);
        break;
      case "exported":
        this.status.textContent = `${event.fileName} is ready.`;
        break;
      case "cameraChanged":
        this.status.textContent = event.description;
        break;
    }
  }

  #progress(done: number, total: number, triangles: number): void {
    const words = total > 0 ? `${stageTitle(this.#stage)}: ${amount(this.#stage, done, total)}` : stageTitle(this.#stage);
    this.caption.textContent = triangles > 0 ? `${words}, ${counted(triangles, "triangle")}.` : `${words}.`;
    const share = total > 0 ? Math.floor(done / total / SPOKEN_SHARE) : 0;
    if (share <= this.#spoken) return;
    this.#spoken = share;
    this.status.textContent = this.caption.textContent;
  }

  #both(words: string): void {
    this.status.textContent = words;
    this.caption.textContent = words;
  }
}

function planned({ keyframes, frames, depth }: PlanSummary): string {
  const source = depth === "sensor" ? "" : `, ${depth === "stereo" ? "depth will be estimated" : "the network will work"} from the photos`;
  return `Planned: ${count(keyframes)} of ${counted(frames, "frame")} kept${source}.`;
}
