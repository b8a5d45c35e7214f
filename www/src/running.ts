/** Progress: which stage, how much of it, and the buttons that hold and stop it. */
import type { IpdReconElement } from "./ipdrecon/index.js";
import { amount, counted, stageOrder, stageTitle } from "./ipdrecon/index.js";
import { byId, make, write } from "./dom.js";
import { seconds } from "./format.js";
import type { Model } from "./model.js";

const steps: HTMLLIElement[] = [];

/** Wires pause and cancel. */
export function wireRunning(viewer: IpdReconElement): void {
  byId("pause").addEventListener("click", () => (viewer.state === "paused" ? viewer.resume() : viewer.pause()));
  byId("cancel").addEventListener("click", () => {
    // While a scan is being read there is nothing yet that could stay.
    if (viewer.state === "opening") viewer.restart();
    else viewer.cancel();
  });
}

/** Draws progress. */
export function drawRunning({ state, stage: told, progress, triangles, plan }: Model): void {
  const opening = state === "opening";
  byId("running").hidden = !opening && state !== "running" && state !== "paused";
  const stage = opening ? "opening" : told;
  const order = stageOrder(plan?.depth);
  const now = stage ? order.indexOf(stage) : 0;
  if (steps.length !== order.length) drawSteps(order.length);
  steps.forEach((step, index) => {
    const name = order[index];
    if (name) write(step.firstElementChild as HTMLElement, (step.title = stageTitle(name)));
    step.className = index < now ? "past" : "";
    if (index === now) step.setAttribute("aria-current", "step");
    else step.removeAttribute("aria-current");
  });

  const bar = byId<HTMLProgressElement>("bar");
  const known = progress !== undefined && progress.total > 0;
  const words = stage ? stageTitle(stage) : "Starting";
  write(byId("bar-words"), known && stage ? `${words}, ${amount(stage, progress.done, progress.total)}` : `${words}…`);
  if (known) {
    bar.max = progress.total;
    bar.value = progress.done;
  } else {
    bar.removeAttribute("value");
  }
  write(byId("triangles"), triangles > 0 ? counted(triangles, "triangle") : "");
  write(byId("elapsed"), progress ? seconds(progress.elapsedS) : "");
  const pause = byId<HTMLButtonElement>("pause");
  pause.hidden = opening;
  write(pause, state === "paused" ? "Go on" : "Pause");
}

/** As many steps as the run has stages. */
function drawSteps(count: number): void {
  steps.length = 0;
  for (let i = 0; i < count; i += 1) {
    const step = make("li");
    step.append(make("span", "", "unseen"));
    steps.push(step);
  }
  byId("stages").replaceChildren(...steps);
}
