/** The ways in: drop anywhere, pick a folder, pick a .zip, or take the sample. */
import type { Droppable, IpdReconElement } from "./ipdrecon/index.js";
import { byId, memory } from "./dom.js";

/** Wires the start view and the drop of the window. */
export function wireStart(viewer: IpdReconElement): void {
  // Failures come as events too, and are shown from there.
  const open = (input: Droppable): void => void viewer.open(input).catch(() => undefined);

  const folderInput = byId<HTMLInputElement>("folder-input");
  const zipInput = byId<HTMLInputElement>("zip-input");
  byId("pick-folder").addEventListener("click", () => void pickFolder(folderInput, open));
  byId("pick-zip").addEventListener("click", () => zipInput.click());
  byId("sample").addEventListener("click", () => void viewer.openSample(undefined, { autostart: true }).catch(() => undefined));
  for (const input of [folderInput, zipInput]) {
    input.addEventListener("change", () => {
      if (input.files && input.files.length > 0) open([...input.files]);
      // The same folder may be chosen again.
      input.value = "";
    });
  }

  const review = byId<HTMLInputElement>("review");
  const asked = new URLSearchParams(location.search).get("autostart");
  review.checked = asked === null ? memory.get("review") === "1" : asked === "0";
  viewer.toggleAttribute("review", review.checked);
  review.addEventListener("change", () => {
    viewer.toggleAttribute("review", review.checked);
    memory.set("review", review.checked ? "1" : null);
  });

  wireWindowDrop(open);
}

async function pickFolder(input: HTMLInputElement, open: (input: Droppable) => void): Promise<void> {
  // Where there is a choice: the input's own question speaks of an upload, which this is not.
  if (window.showDirectoryPicker) {
    try {
      open(await window.showDirectoryPicker());
      return;
    } catch (cause) {
      if (cause instanceof DOMException && cause.name === "AbortError") return;
    }
  }
  input.click();
}

function wireWindowDrop(open: (input: Droppable) => void): void {
  const veil = byId("veil");
  const carriesFiles = (event: DragEvent): boolean => event.dataTransfer?.types.includes("Files") ?? false;
  addEventListener("dragenter", (event) => {
    if (carriesFiles(event)) veil.hidden = false;
  });
  addEventListener("dragover", (event) => {
    if (!carriesFiles(event)) return;
    event.preventDefault();
    veil.hidden = false;
  });
  addEventListener("dragleave", (event) => {
    if (event.relatedTarget === null) veil.hidden = true;
  });
  addEventListener("drop", (event) => {
    veil.hidden = true;
    // A drop on the view has been taken by the element itself.
    if (event.defaultPrevented || !event.dataTransfer || !carriesFiles(event)) return;
    event.preventDefault();
    open(event.dataTransfer);
  });
}

declare global {
  interface Window {
    showDirectoryPicker?: () => Promise<FileSystemDirectoryHandle>;
  }
}
