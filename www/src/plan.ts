/** The plan in numbers before any work is done, and the options that change it. */
import type { IpdReconElement, PlanSummary, RunOptions } from "./ipdrecon/index.js";
import { count } from "./ipdrecon/index.js";
import { byId, list, make, write } from "./dom.js";
import { bytes, centimetres, plain } from "./format.js";
import type { Model } from "./model.js";

const voxel = byId<HTMLSelectElement>("voxel-size");
const every = byId<HTMLSelectElement>("every");
const depth = byId<HTMLSelectElement>("max-depth");
let drawn: { plan: PlanSummary; choosing: boolean } | undefined;

/** Wires the options. */
export function wirePlan(viewer: IpdReconElement): void {
  const form = byId<HTMLFormElement>("options");
  form.addEventListener("change", () => {
    // After a run the plan on show is the one of the mesh on show; new options count from the next start.
    if (viewer.state === "planned") viewer.replan(options()).catch(() => undefined);
  });
  form.addEventListener("submit", (event) => {
    event.preventDefault();
    viewer.run(options()).catch(() => undefined);
  });
}

/** Draws the plan. */
export function drawPlan({ state, plan, ready, opened }: Model): void {
  const shown = plan !== undefined && state !== "failed" && state !== "opening";
  byId("plan").hidden = !shown;
  const choosing = state === "planned" || state === "finished";
  byId("options").hidden = !choosing;
  write(byId("run"), state === "finished" ? "Run again" : "Start");
  if (!shown || (plan === drawn?.plan && choosing === drawn.choosing)) return;
  drawn = { plan, choosing };
  list(byId("plan-list"), [
    ["Frames kept", `${count(plan.keyframes)} of ${count(plan.frames)}`],
    // Where they can be chosen, the menus say it.
    ...(choosing ? [] : [["Voxel size", centimetres(plan.options.voxelSizeM)] as const, ["Depth up to", `${plain(plan.options.maxDepthM)} m`] as const]),
    ["Bricks", `about ${count(plan.bricks)}`],
    [ready?.device === "cpu" ? "Volume" : "Graphics memory", `about ${bytes(plan.deviceBytes)}`],
    ["Engine memory", `about ${bytes(plan.heapBytes)}`],
  ]);
  write(byId("gravity"), opened ? `Up: ${opened.gravity}.` : "");
  byId("remarks").replaceChildren(...plan.remarks.map((remark) => make("li", remark)));
  select(voxel, plan.options.voxelSizeM, centimetres);
  select(every, plan.options.every, (n) => `every ${n}th`);
  select(depth, plan.options.maxDepthM, (m) => `${plain(m)} m`);
}

function options(): RunOptions {
  return { voxelSizeM: Number(voxel.value), every: Number(every.value), maxDepthM: Number(depth.value) };
}

/** Selects a value, which gets an entry of its own if it is none of those on offer. */
function select(menu: HTMLSelectElement, value: number, words: (value: number) => string): void {
  const text = String(plain(value));
  if (![...menu.options].some((option) => option.value === text)) menu.add(new Option(words(value), text));
  menu.value = text;
}
