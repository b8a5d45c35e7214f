/** The plan in numbers before any work is done, and the options that change it. */
import type { DepthSource, IpdReconElement, PixelSize, PlanSummary, RunOptions } from "./ipdrecon/index.js";
import { count } from "./ipdrecon/index.js";
import { byId, list, make, write } from "./dom.js";
import { bytes, centimetres, pixels, plain } from "./format.js";
import type { Model } from "./model.js";

const source = byId<HTMLSelectElement>("depth-source");
const size = byId<HTMLSelectElement>("stereo-size");
const voxel = byId<HTMLSelectElement>("voxel-size");
const kept = byId<HTMLSelectElement>("keyframes");
const depth = byId<HTMLSelectElement>("max-depth");
let drawn: { plan: PlanSummary; choosing: boolean } | undefined;

/** Wires the options. */
export function wirePlan(viewer: IpdReconElement): void {
  const form = byId<HTMLFormElement>("options");
  form.addEventListener("change", () => {
    drawSize();
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
  const stereo = plan.depth === "stereo";
  const { voxelSizeM, maxDepthM, stereoSize } = plan.options;
  list(byId("plan-list"), [
    ["Frames kept", `${count(plan.keyframes)} of ${count(plan.frames)}`],
    // Where they can be chosen, the menus say it.
    ...(choosing ? [] : [["Depth", stereo ? "estimated from photos" : "from the sensor"] as const]),
    ...(choosing || !stereo ? [] : [["Photos scaled to", pixels(stereoSize)] as const]),
    ...(choosing ? [] : [["Voxel size", centimetres(voxelSizeM)] as const, ["Depth up to", `${plain(maxDepthM)} m`] as const]),
    ["Bricks", `about ${count(plan.bricks)}`],
    [ready?.device === "cpu" ? "Working memory" : "Graphics memory", `about ${bytes(plan.deviceBytes)}`],
    ["Engine memory", `about ${bytes(plan.heapBytes)}`],
  ]);
  write(byId("gravity"), opened ? `Up: ${opened.gravity}.` : "");
  byId("remarks").replaceChildren(...plan.remarks.map((remark) => make("li", remark)));
  drawSource(plan.depth, opened);
  select(voxel, String(plain(voxelSizeM)), centimetres(voxelSizeM));
  const { every, views } = plan.options;
  select(kept, `${every}/${views ?? ""}`, [views ? `${views}` : "", every > 1 ? `every ${every}th` : ""].filter(Boolean).join(" of "));
  select(depth, String(plain(maxDepthM)), `${plain(maxDepthM)} m`);
  if (stereo) select(size, `${stereoSize.widthPx}x${stereoSize.heightPx}`, pixels(stereoSize));
  drawSize();
}

/** Which of the two sources there is to choose from, and why only one of them if so. */
function drawSource(chosen: DepthSource, opened: Model["opened"]): void {
  source.value = chosen;
  const { hasDepth = true, hasColor = true } = opened ?? {};
  source.disabled = !hasDepth || !hasColor;
  const note = byId("depth-note");
  if (!hasDepth) write(note, "This scan has no depth images: depth is estimated from its photos. Walls without any texture may stay open.");
  else if (!hasColor) write(note, "This scan has no photos to estimate depth from.");
  else write(note, chosen === "stereo" ? "Depth is estimated from the photos, which takes longer. Walls without any texture may stay open." : "");
}

/** Photos are scaled for stereo alone. */
function drawSize(): void {
  (size.parentElement as HTMLElement).hidden = source.value !== "stereo";
}

function options(): RunOptions {
  const [every, views] = kept.value.split("/");
  const [widthPx, heightPx] = size.value.split("x").map(Number) as [number, number];
  const stereoSize: PixelSize = { widthPx, heightPx };
  return {
    voxelSizeM: Number(voxel.value),
    every: Number(every),
    views: Number(views) || undefined,
    maxDepthM: Number(depth.value),
    depth: source.value as DepthSource,
    stereoSize,
  };
}

/** Selects a value, which gets an entry of its own if it is none of those on offer. */
function select(menu: HTMLSelectElement, value: string, words: string): void {
  if (![...menu.options].some((option) => option.value === value)) menu.add(new Option(words, value));
  menu.value = value;
}
