/** The panel beside the room: its heading, and which of its parts are there in which state. */
import type { IpdReconElement, State } from "./ipdrecon/index.js";
import { counted } from "./ipdrecon/index.js";
import { byId, write } from "./dom.js";
import type { Model } from "./model.js";
import { drawDone, wireDone } from "./done.js";
import { drawFailure, wireFailure } from "./failure.js";
import { drawFindings } from "./findings.js";
import { drawPlan, wirePlan } from "./plan.js";
import { drawRunning, wireRunning } from "./running.js";

const TITLES: Record<State, string> = {
  starting: "",
  idle: "",
  opening: "Reading the scan",
  planned: "Ready to start",
  running: "Reconstructing",
  paused: "Paused",
  finished: "Finished",
  failed: "",
};

/** Wires the buttons of the panel. */
export function wirePanel(viewer: IpdReconElement): void {
  const fold = byId("panel-fold");
  fold.addEventListener("click", () => {
    const folded = byId("panel").classList.toggle("folded");
    fold.setAttribute("aria-expanded", String(!folded));
  });
  wireRunning(viewer);
  wirePlan(viewer);
  wireDone(viewer);
  wireFailure(viewer);
}

/** Draws the panel. */
export function drawPanel(model: Model): void {
  write(byId("panel-title"), title(model));
  write(byId("panel-sub"), subtitle(model));
  drawRunning(model);
  drawFailure(model);
  drawDone(model);
  drawPlan(model);
  drawFindings(model);
  const note = byId("panel-note");
  note.hidden = model.state === "failed" || !model.ready?.note;
  write(note, model.ready?.note ?? "");
}

function title({ state, failed, finished, stage }: Model): string {
  if (state === "failed") return failed?.message ?? "Work cannot go on.";
  if (state === "finished" && finished?.cancelled) return "Stopped";
  return state === "running" && stage === undefined ? "Starting" : TITLES[state];
}

function subtitle({ opened }: Model): string {
  if (!opened) return "";
  const depth = opened.hasDepth ? "" : ", without depth";
  return `${opened.name} · ${opened.format}, ${counted(opened.frames, "frame")}${depth}`;
}
