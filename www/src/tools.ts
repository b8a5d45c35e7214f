/** The buttons that lie over the view. */
import type { IpdReconElement } from "./ipdrecon/index.js";
import { byId, save } from "./dom.js";
import type { Model } from "./model.js";

/** Wires them. */
export function wireTools(viewer: IpdReconElement): void {
  byId("shading").addEventListener("change", (event) => viewer.setAttribute("shading", (event.target as HTMLInputElement).value));
  byId("look-home").addEventListener("click", () => viewer.look({ kind: "home" }));
  byId("look-top").addEventListener("click", () => viewer.look({ kind: "top" }));
  for (const name of ["cameras", "back-faces"]) {
    const button = byId(name);
    button.addEventListener("click", () => button.setAttribute("aria-pressed", String(viewer.toggleAttribute(name))));
  }
  byId("screenshot").addEventListener("click", () => void viewer.screenshot().then(save, () => undefined));
}

/** They are there while there is something to look at. */
export function drawTools({ state }: Model): void {
  byId("tools").hidden = state !== "running" && state !== "paused" && state !== "finished";
}
