/** When work cannot go on: why, what to try, a report to copy, and the way back. */
import type { IpdReconElement } from "./ipdrecon/index.js";
import { version } from "./ipdrecon/index.js";
import { byId, write } from "./dom.js";
import { place } from "./findings.js";
import type { Model } from "./model.js";

/** Wires the way back and the report. */
export function wireFailure(viewer: IpdReconElement): void {
  byId("failure-back").addEventListener("click", () => viewer.restart());
  const copy = byId("report-copy");
  copy.addEventListener("click", async () => {
    try {
      await navigator.clipboard.writeText(byId("report").textContent);
      write(copy, "Copied");
    } catch {
      // The browser keeps its clipboard closed: the text is selected instead, for the visitor's own keys.
      getSelection()?.selectAllChildren(byId("report"));
      write(copy, "Selected, press Ctrl+C");
    }
  });
}

/** Draws the failure. */
export function drawFailure(model: Model): void {
  const shown = model.state === "failed" && model.failed !== undefined;
  byId("failure").hidden = !shown;
  if (!shown) return;
  write(byId("failure-advice"), model.failed?.advice ?? "");
  write(byId("report"), report(model));
  write(byId("report-copy"), "Copy");
}

/** Everything that helps to find the cause, and nothing of the photos. */
function report({ failed, ready, opened, plan, stage, progress, findings }: Model): string {
  const lines = [
    `IPDRecon ${version}, ${new Date().toISOString()}`,
    `failed: ${failed?.code ?? ""}: ${failed?.message ?? ""}`,
    stage ? `stage: ${stage}${progress ? ` ${progress.done}/${progress.total}` : ""}` : "",
    ready ? `device: ${ready.device}, ${ready.adapter}${ready.note ? ` (${ready.note})` : ""}` : "device: none",
    opened ? `scan: ${opened.format}, ${opened.frames} frames, up: ${opened.gravity}` : "",
    plan ? `plan: ${JSON.stringify(plan)}` : "",
    `browser: ${navigator.userAgent}`,
    `screen: ${innerWidth} x ${innerHeight} at ${devicePixelRatio}, ${navigator.hardwareConcurrency} cores, WebGPU ${"gpu" in navigator ? "offered" : "absent"}`,
    ...findings.map((f) => `${f.severity} ${f.code} ${place(f)}: expected ${f.expected}; found ${f.found}`),
  ];
  return lines.filter((line) => line !== "").join("\n");
}
