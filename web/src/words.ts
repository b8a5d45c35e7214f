/** What the engine's events are called in front of people: on the page, in the caption and by the announcer. */
import type { DepthSource, StageName } from "./engine.js";

const STAGES: Record<StageName, string> = {
  opening: "Reading the scan",
  downloading: "Fetching the network",
  warmingUp: "Warming up",
  matching: "Matching views",
  fusing: "Fusing depth",
  features: "Looking at the pictures",
  coarse: "Finding the room",
  medium: "Finding surfaces",
  fine: "Shaping surfaces",
  coloring: "Colouring",
  meshing: "Finishing the mesh",
};

const WORK: Record<DepthSource, readonly StageName[]> = {
  sensor: ["fusing"],
  stereo: ["matching"],
  network: ["features", "matching", "coarse", "medium", "fine", "coloring"],
};

/** The stages in the order in which they come. */
export function stageOrder(depth: DepthSource = "sensor"): readonly StageName[] {
  return ["opening", ...(depth === "network" ? ["downloading" as const] : []), "warmingUp", ...WORK[depth], "meshing"];
}

/** A stage in words. */
export function stageTitle(stage: StageName): string {
  return STAGES[stage];
}

/** How much of a stage is done, in what it is counted in. */
export function amount(stage: StageName, done: number, total: number): string {
  if (stage !== "downloading") return `${count(done)} of ${count(total)}`;
  const megabytes = (bytes: number): string => (bytes / 1e6).toFixed(1);
  return `${megabytes(done)} of ${megabytes(total)} MB`;
}

/** A count in the reader's own way of writing numbers. */
export function count(n: number): string {
  return n.toLocaleString();
}

/** A count with its noun: `1 frame`, `2 frames`. */
export function counted(n: number, noun: string): string {
  return `${count(n)} ${noun}${n === 1 ? "" : "s"}`;
}
