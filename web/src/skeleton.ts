/** The inside of the element: what is in its shadow root, and how it looks before a page styles it. */

/** The parts of the shadow root. */
export interface Parts {
  /** Holds the canvas. */
  stage: HTMLElement;
  /** Shown while there is nothing to see; a page may fill its slot. */
  empty: HTMLElement;
  /** What is going on, for the eye. */
  caption: HTMLElement;
  /** What is going on, for the ear. */
  status: HTMLElement;
}

const CSS = `
:host { display: block; position: relative; min-height: 12rem; contain: strict; color-scheme: light dark; }
:host([hidden]) { display: none; }
.stage, .stage canvas { position: absolute; inset: 0; width: 100%; height: 100%; }
.stage canvas { display: block; outline: none; opacity: 0; }
.stage.live canvas { opacity: 1; cursor: grab; touch-action: none; }
.stage.live canvas:active { cursor: grabbing; }
.stage canvas:focus-visible { outline: 2px solid var(--ipd-focus, Highlight); outline-offset: -2px; }
.stage.drop::after { content: ""; position: absolute; inset: 0; border: 2px dashed var(--ipd-focus, Highlight); pointer-events: none; }
.empty { position: absolute; inset: 0; display: grid; place-items: center; padding: 1rem; text-align: center; pointer-events: none; }
.empty[hidden] { display: none; }
.caption { position: absolute; inset: auto auto 0.75rem 0.75rem; max-width: calc(100% - 2.5rem); padding: 0.25rem 0.6rem;
  border-radius: 0.5rem; background: Canvas; color: CanvasText; font: 0.8125rem/1.4 system-ui, sans-serif; opacity: 0.9; }
.caption:empty { display: none; }
.status { position: absolute; width: 1px; height: 1px; overflow: hidden; clip-path: inset(50%); white-space: nowrap; }
`;

/** Fills a shadow root. */
export function skeleton(root: ShadowRoot): Parts {
  const sheet = new CSSStyleSheet();
  sheet.replaceSync(CSS);
  root.adoptedStyleSheets = [sheet];
  const part = (name: string): HTMLElement => {
    const element = document.createElement("div");
    element.className = name;
    element.setAttribute("part", name);
    return element;
  };
  const parts = { stage: part("stage"), empty: part("empty"), caption: part("caption"), status: part("status") };
  const slot = document.createElement("slot");
  slot.name = "empty";
  slot.textContent = "Drop a folder of posed photos here, or a .zip of it.";
  parts.empty.append(slot);
  parts.caption.setAttribute("aria-hidden", "true");
  parts.status.setAttribute("role", "status");
  root.append(parts.stage, parts.empty, parts.caption, parts.status);
  return parts;
}
