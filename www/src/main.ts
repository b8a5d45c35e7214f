/** The page: puts the element in its place, feeds events to the model, and draws the model once a frame. */
import type { EngineEvent } from "./ipdrecon/index.js";
import "./ipdrecon/index.js";
import { byId, write } from "./dom.js";
import { blank, enter, take, type Model } from "./model.js";
import { drawPanel, wirePanel } from "./panel.js";
import { wireStart } from "./start.js";
import { onTheme, toggleTheme } from "./theme.js";
import { drawTools, wireTools } from "./tools.js";

const viewer = document.createElement("ipd-recon");
const query = new URLSearchParams(location.search);
let model: Model = blank();
let scheduled = false;

function change(next: Model): void {
  model = next;
  if (scheduled) return;
  scheduled = true;
  requestAnimationFrame(draw);
}

function draw(): void {
  scheduled = false;
  const place = placeOf(model);
  const atStart = place === "start";
  const moved = document.body.dataset.place !== place;
  document.body.dataset.place = place;
  byId("start").hidden = !atStart;
  byId("panel").hidden = atStart;
  byId("new-scan").hidden = atStart;
  drawDevice(model);
  drawTools(model);
  drawPanel(model);
  keepFocus(moved, atStart);
}

/** The start, a card in the middle while there is no room to look at, or the room with the panel beside it. */
function placeOf({ state }: Model): "start" | "card" | "work" {
  if (state === "starting" || state === "idle") return "start";
  return state === "running" || state === "paused" || state === "finished" ? "work" : "card";
}

function drawDevice({ ready }: Model): void {
  const chip = byId("device");
  chip.hidden = !ready;
  write(chip, ready?.device === "cpu" ? "CPU" : "WebGPU");
  chip.title = ready?.adapter ?? "";
  const note = byId("device-note");
  note.hidden = !ready?.note;
  write(note, ready?.note ?? "");
}

/** When the focused button has gone with its part of the page, the heading of what came instead takes over. */
function keepFocus(moved: boolean, atStart: boolean): void {
  const active = document.activeElement;
  const lost = active === null || active === document.body || active.closest("[hidden]") !== null;
  if (moved ? lost : active?.closest("[hidden]")) byId(atStart ? "start-title" : "panel-title").focus();
}

for (const type of ["ready", "opened", "weights", "planned", "stage", "progress", "bricks", "finding", "finished", "failed", "exported"] as const) {
  viewer.addEventListener(`ipd-${type}`, (event) => change(take(model, (event as CustomEvent<EngineEvent>).detail)));
}
viewer.addEventListener("ipd-state", ({ detail }) => change(enter(model, detail)));

onTheme((theme) => {
  viewer.setAttribute("theme", theme);
  byId("theme").setAttribute("aria-label", theme === "dark" ? "Switch to light" : "Switch to dark");
});
byId("theme").addEventListener("click", toggleTheme);
byId("new-scan").addEventListener("click", () => viewer.restart());
const help = byId<HTMLDialogElement>("help");
byId("help-open").addEventListener("click", () => help.showModal());
help.addEventListener("click", (event) => {
  if (event.target === help) help.close();
});

wireStart(viewer);
wireTools(viewer, () => drawTools(model));
wirePanel(viewer);

viewer.setAttribute("device", query.get("device") ?? "auto");
viewer.append(Object.assign(document.createElement("span"), { slot: "empty" }));
byId("stage").prepend(viewer);
if (query.has("sample")) viewer.openSample(Number(query.get("sample")) || undefined, { autostart: query.get("autostart") !== "0" }).catch(() => undefined);
