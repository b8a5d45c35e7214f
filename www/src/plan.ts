/** The plan in numbers before any work is done, and the options that change it. */
import type { DepthSource, IpdReconElement, PixelSize, PlanSummary, PresetName, RunOptions } from "./ipdrecon/index.js";
import { count } from "./ipdrecon/index.js";
import { byId, list, make, write } from "./dom.js";
import { about, bytes, centimetres, pixels, plain } from "./format.js";
import type { Model } from "./model.js";

const source = byId<HTMLSelectElement>("depth-source");
const size = byId<HTMLSelectElement>("stereo-size");
const preset = byId<HTMLSelectElement>("preset");
const voxel = byId<HTMLSelectElement>("voxel-size");
const kept = byId<HTMLSelectElement>("keyframes");
const depth = byId<HTMLSelectElement>("max-depth");
const WORDS: Record<DepthSource, string> = { sensor: "from the sensor", stereo: "estimated from photos", network: "by the network, from photos" };
const PRESETS: Record<PresetName, string> = { small: "160 × 120, 20 views", medium: "320 × 240, 60 views", full: "640 × 480, 100 views" };
let drawn: { plan: PlanSummary; choosing: boolean } | undefined;

/** Wires the options. */
export function wirePlan(viewer: IpdReconElement): void {
  const form = byId<HTMLFormElement>("options");
  form.addEventListener("change", () => {
    drawSize();
    // After a run the plan on show is the one of the mesh on show; new options count from the next start.
    if (viewer.state === "planned") viewer.replan(options()).catch(() => undefined);
  });
  const weights = byId<HTMLInputElement>("weights");
  byId("pick-weights").addEventListener("click", () => weights.click());
  weights.addEventListener("change", () => {
    const [file] = weights.files ?? [];
    if (file) viewer.useWeights(file);
    weights.value = "";
  });
  form.addEventListener("submit", (event) => {
    event.preventDefault();
    viewer.run(options()).catch(() => undefined);
  });
}

/** Draws the plan. */
export function drawPlan({ state, plan, ready, opened, weights }: Model): void {
  const shown = plan !== undefined && state !== "failed" && state !== "opening";
  byId("plan").hidden = !shown;
  const choosing = state === "planned" || state === "finished";
  byId("options").hidden = !choosing;
  write(byId("run"), state === "finished" ? "Run again" : "Start");
  write(byId("weights-name"), weights ? `Weights: ${weights.name}, ${bytes(weights.bytes)}` : "Weights: those of this page, fetched once and kept");
  if (!shown || (plan === drawn?.plan && choosing === drawn.choosing)) return;
  drawn = { plan, choosing };
  const stereo = plan.depth === "stereo";
  const network = plan.depth === "network";
  const { voxelSizeM, maxDepthM, stereoSize } = plan.options;
  list(byId("plan-list"), [
    ["Frames kept", `${count(plan.keyframes)} of ${count(plan.frames)}`],
    // Where they can be chosen, the menus say it.
    ...(choosing ? [] : [[network ? "Surface" : "Depth", WORDS[plan.depth]] as const]),
    ...(choosing || !stereo ? [] : [["Photos scaled to", pixels(stereoSize)] as const]),
    ...(choosing || !network ? [] : [["Network", PRESETS[plan.options.preset]] as const]),
    ...(choosing ? [] : [["Voxel size", centimetres(voxelSizeM)] as const]),
    ...(choosing || network ? [] : [["Depth up to", `${plain(maxDepthM)} m`] as const]),
    ["Bricks", `about ${count(plan.bricks)}`],
    [ready?.device === "cpu" ? "Working memory" : "Graphics memory", `about ${bytes(plan.deviceBytes)}`],
    ["Engine memory", `about ${bytes(plan.heapBytes)}`],
    ...(plan.downloadBytes ? [["Download", `${bytes(plan.downloadBytes)} of weights, once`] as const] : []),
    ...(plan.expectedS === undefined ? [] : [["Expected time", about(plan.expectedS)] as const]),
  ]);
  write(byId("gravity"), opened ? `Up: ${opened.gravity}.` : "");
  byId("remarks").replaceChildren(...[...onProcessor(plan, ready), ...plan.remarks].map((remark) => make("li", remark)));
  drawSource(plan.depth, opened);
  select(voxel, String(plain(voxelSizeM)), centimetres(voxelSizeM));
  const { every, views } = plan.options;
  select(kept, `${every}/${views ?? ""}`, [views ? `${views}` : "", every > 1 ? `every ${every}th` : ""].filter(Boolean).join(" of "));
  select(depth, String(plain(maxDepthM)), `${plain(maxDepthM)} m`);
  if (network) select(preset, plan.options.preset, PRESETS[plan.options.preset]);
  if (stereo) select(size, `${stereoSize.widthPx}x${stereoSize.heightPx}`, pixels(stereoSize));
  drawSize();
}

/** Without a graphics adapter the network is slow enough to be announced. */
function onProcessor({ depth, options, expectedS }: PlanSummary, ready: Model["ready"]): string[] {
  if (ready?.device !== "cpu" || depth !== "network") return [];
  const time = expectedS === undefined ? "" : `, in ${about(expectedS)}`;
  return [`The processor does the work, with ${PRESETS[options.preset]}${time}`];
}

/** Which of the sources there are to choose from, and why not all of them if so. */
function drawSource(chosen: DepthSource, opened: Model["opened"]): void {
  source.value = chosen;
  const { hasDepth = true, hasColor = true } = opened ?? {};
  for (const option of source.options) option.disabled = option.value === "sensor" ? !hasDepth : !hasColor;
  source.disabled = !hasColor;
  const note = byId("depth-note");
  const without = hasDepth ? "" : "This scan has no depth images. ";
  if (!hasColor) write(note, "This scan has no photos to estimate depth from.");
  else if (chosen === "network") write(note, `${without}A trained network makes the surface from the photos.`);
  else if (chosen === "stereo") write(note, `${without}Depth is estimated from the photos, which takes longer than a sensor's. Walls without any texture may stay open.`);
  else write(note, "");
}

/** Photos are scaled for stereo alone, and the network has its own voxels and reach. */
function drawSize(): void {
  const is = (name: DepthSource): boolean => source.value === name;
  (size.parentElement as HTMLElement).hidden = !is("stereo");
  byId("network").hidden = !is("network");
  for (const menu of [voxel, depth]) (menu.parentElement as HTMLElement).hidden = is("network");
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
    preset: preset.value as PresetName,
  };
}

/** Selects a value, which gets an entry of its own if it is none of those on offer. */
function select(menu: HTMLSelectElement, value: string, words: string): void {
  if (![...menu.options].some((option) => option.value === value)) menu.add(new Option(words, value));
  menu.value = value;
}
