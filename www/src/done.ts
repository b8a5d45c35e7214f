/** The end of a run: what came of it, and the mesh as a file. */
import type { IpdReconElement, MeshFormat } from "./ipdrecon/index.js";
import { count } from "./ipdrecon/index.js";
import { byId, list, save, write } from "./dom.js";
import { bytes, seconds } from "./format.js";
import type { Model } from "./model.js";

let drawn: Model["finished"];

/** Wires the export buttons. */
export function wireDone(viewer: IpdReconElement): void {
  const canonical = byId<HTMLInputElement>("canonical");
  for (const button of document.querySelectorAll<HTMLButtonElement>("[data-format]")) {
    button.addEventListener("click", async () => {
      button.disabled = true;
      button.setAttribute("aria-busy", "true");
      try {
        save(await viewer.exportMesh(button.dataset.format as MeshFormat, { canonical: canonical.checked }));
      } catch {
        // Told by the `failed` event, and drawn from there.
      } finally {
        button.disabled = false;
        button.removeAttribute("aria-busy");
      }
    });
  }
}

/** Draws the summary. */
export function drawDone({ state, finished, exportFailed }: Model): void {
  byId("done").hidden = state !== "finished";
  const failed = byId("export-failed");
  failed.hidden = !exportFailed;
  write(failed, exportFailed ? `${exportFailed.message} ${exportFailed.advice}` : "");
  if (!finished || finished === drawn) return;
  drawn = finished;
  list(byId("summary"), [
    ["Triangles", count(finished.triangles)],
    ["Frames fused", count(finished.frames)],
    ["Bricks", count(finished.bricks)],
    ["Time", seconds(finished.elapsedS)],
    ["Engine memory", bytes(finished.heapBytes)],
  ]);
}
