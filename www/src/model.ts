/**
 * What the page knows, and how each event of the engine changes it. Every part of the page is drawn from this alone, once a
 * frame, however fast events come.
 */
import type { EngineEvent, EventOf, FindingMessage, PlanSummary, StageName, State } from "./ipdrecon/index.js";

/** All of it. */
export interface Model {
  state: State;
  ready?: EventOf<"ready">;
  opened?: EventOf<"opened">;
  plan?: PlanSummary;
  /** Weights that the visitor gave. */
  weights?: EventOf<"weights">;
  findings: FindingMessage[];
  /** How many of the findings are about the scan itself: those of a run go when it is run again. */
  ofScan: number;
  stage?: StageName;
  progress?: EventOf<"progress">;
  triangles: number;
  finished?: EventOf<"finished">;
  failed?: EventOf<"failed">;
  exportFailed?: EventOf<"failed">;
}

/** What a page knows that has just been opened. */
export function blank(): Model {
  return { state: "starting", findings: [], ofScan: 0, triangles: 0 };
}

/** Takes a new state in. A scan that is being opened begins with nothing; a new engine has not said what it is yet. */
export function enter(model: Model, state: State): Model {
  if (state === "opening") return { ...blank(), ready: model.ready, weights: model.weights, state };
  if (state === "starting") return { ...blank(), state };
  if (state === "planned") return { ...model, state, ofScan: model.findings.length };
  if (state === "running" && model.state !== "paused") {
    return { ...model, state, findings: model.findings.slice(0, model.ofScan), finished: undefined, stage: undefined, progress: undefined, exportFailed: undefined };
  }
  return { ...model, state };
}

/** Takes an event in. */
export function take(model: Model, event: EngineEvent): Model {
  switch (event.type) {
    case "ready":
      return { ...model, ready: event };
    case "opened":
      return { ...model, opened: event };
    case "weights":
      return { ...model, weights: event };
    case "planned":
      return { ...model, plan: event.plan };
    case "stage":
      return { ...model, stage: event.stage, progress: undefined };
    case "progress":
      return { ...model, progress: event, triangles: event.triangles };
    case "bricks":
      return { ...model, triangles: event.triangles };
    case "finding":
      return { ...model, findings: [...model.findings, event.finding] };
    case "finished":
      return { ...model, finished: event, triangles: event.triangles };
    case "failed":
      return event.code === "export" ? { ...model, exportFailed: event } : { ...model, failed: event };
    case "exported":
      return { ...model, exportFailed: undefined };
    default:
      return model;
  }
}
