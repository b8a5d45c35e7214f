/** The buttons that lie over the view. */
import type { DepthSource, IpdReconElement } from "./ipdrecon/index.js";
import { byId, make, save, write } from "./dom.js";
import type { Model } from "./model.js";

/** What the colours of a shading mean, from the dark end to the light one, in even steps. */
const LEGENDS: Record<string, { words: Record<DepthSource, string>; ticks: string[] } | undefined> = {
  confidence: {
    words: { sensor: "", stereo: "Confidence of the depth, mean of its photos", network: "Confidence of the network, mean of its views" },
    ticks: ["0", "0.5", "1"],
  },
  views: {
    words: { sensor: "Frames that measured it", stereo: "Photos whose depth shows it", network: "Views that have it in the picture" },
    ticks: ["1", "2", "4", "8", "16", "32+"],
  },
};
const chosen = (): HTMLInputElement => byId("shading").querySelector<HTMLInputElement>(":checked") as HTMLInputElement;
const confidence = byId("shading").querySelector<HTMLInputElement>("[value=confidence]") as HTMLInputElement;

/** Wires them. */
export function wireTools(viewer: IpdReconElement, redraw: () => void): void {
  byId("shading").addEventListener("change", () => {
    viewer.setAttribute("shading", chosen().value);
    redraw();
  });
  byId("look-home").addEventListener("click", () => viewer.look({ kind: "home" }));
  byId("look-top").addEventListener("click", () => viewer.look({ kind: "top" }));
  for (const name of ["cameras", "back-faces"]) {
    const button = byId(name);
    button.addEventListener("click", () => button.setAttribute("aria-pressed", String(viewer.toggleAttribute(name))));
  }
  byId("screenshot").addEventListener("click", () => void viewer.screenshot().then(save, () => undefined));
}

/** They are there while there is something to look at. */
export function drawTools({ state, plan }: Model): void {
  byId("tools").hidden = state !== "running" && state !== "paused" && state !== "finished";
  // A sensor does not say how sure it is.
  confidence.disabled = plan?.depth === "sensor";
  if (confidence.disabled && confidence.checked) byId("shading").querySelector<HTMLInputElement>("[value=color]")?.click();
  const legend = plan && LEGENDS[chosen().value];
  byId("legend").hidden = !legend;
  if (!legend) return;
  const ticks = byId("legend-ticks");
  write(byId("legend-title"), legend.words[plan.depth]);
  if (ticks.childElementCount !== legend.ticks.length) ticks.replaceChildren(...legend.ticks.map((tick) => make("li", tick)));
}
