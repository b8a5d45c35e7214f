/**
 * The visitor's hands on the canvas, made plain for the engine: positions in physical pixels, wheels in one unit, keys only
 * while the canvas has the focus.
 */
import type { InputEvent } from "./engine.js";

/** Lines of a wheel that counts in lines, in CSS pixels. */
const LINE_PX = 16;
/** A trackpad's pinch comes as a wheel with Ctrl held and with small numbers. */
const PINCH_GAIN = 7;
/** More pixels than this per CSS pixel cost time and show nothing. */
const MOST_PIXEL_RATIO = 2;
/** Keys that would scroll the page. */
const SCROLLING = /^(Arrow|Page|Home$|End$|Space$)/;
/** Keys that stay with the browser: a way out of the canvas, and its menus. */
const RESERVED = /^(Tab|Escape|Enter|F\d+|ContextMenu)$/;

/** The size of a drawing buffer. */
export interface PixelSize {
  widthPx: number;
  heightPx: number;
  pixelRatio: number;
}

/** The drawing buffer that suits the canvas as it is laid out now. */
export function pixelSize(canvas: HTMLCanvasElement): PixelSize {
  const pixelRatio = Math.min(devicePixelRatio || 1, MOST_PIXEL_RATIO);
  return {
    widthPx: Math.max(1, Math.round(canvas.clientWidth * pixelRatio)),
    heightPx: Math.max(1, Math.round(canvas.clientHeight * pixelRatio)),
    pixelRatio,
  };
}

/**
 * Forwards pointer, wheel, keys and size of `canvas` to `send` until `signal` is aborted.
 *
 * @param active Whether there is something to move: if not, wheel and keys are left to the page around the canvas.
 */
export function forwardInput(
  canvas: HTMLCanvasElement,
  send: (input: InputEvent) => void,
  active: () => boolean,
  signal: AbortSignal,
): void {
  let ratio = pixelSize(canvas).pixelRatio;
  const down = new Set<number>();
  const held = new Set<string>();
  const at = ({ offsetX, offsetY }: MouseEvent): { x: number; y: number } => ({ x: offsetX * ratio, y: offsetY * ratio });
  const listen = <K extends keyof HTMLElementEventMap>(
    type: K,
    listener: (event: HTMLElementEventMap[K]) => void,
    options?: AddEventListenerOptions,
  ): void => canvas.addEventListener(type, listener, { ...options, signal });

  listen("pointerdown", (event) => {
    canvas.focus({ preventScroll: true });
    canvas.setPointerCapture(event.pointerId);
    down.add(event.pointerId);
    const { pointerId: id, button, pointerType, shiftKey: shift } = event;
    send({ kind: "pointerDown", id, ...at(event), button: Math.max(0, button), touch: pointerType === "touch", shift });
  });
  listen("pointermove", (event) => {
    if (down.has(event.pointerId)) send({ kind: "pointerMove", id: event.pointerId, ...at(event) });
  });
  const lift = ({ pointerId: id }: PointerEvent): void => {
    if (down.delete(id)) send({ kind: "pointerUp", id });
  };
  listen("pointerup", lift);
  listen("pointercancel", lift);
  listen("lostpointercapture", lift);
  listen("dblclick", (event) => send({ kind: "doubleClick", ...at(event) }));
  // The right button pans; its menu would be in the way.
  listen("contextmenu", (event) => event.preventDefault());

  listen(
    "wheel",
    (event) => {
      if (!active()) return;
      event.preventDefault();
      const unit = [1, LINE_PX, canvas.clientHeight][event.deltaMode] ?? 1;
      send({ kind: "wheel", delta: event.deltaY * unit * (event.ctrlKey ? PINCH_GAIN : 1), ...at(event) });
    },
    { passive: false },
  );

  listen("keydown", (event) => {
    if (!active() || event.ctrlKey || event.metaKey || event.altKey || RESERVED.test(event.code)) return;
    if (SCROLLING.test(event.code)) event.preventDefault();
    if (held.has(event.code)) return;
    held.add(event.code);
    send({ kind: "key", code: event.code, down: true });
  });
  listen("keyup", (event) => {
    if (held.delete(event.code)) send({ kind: "key", code: event.code, down: false });
  });
  listen("blur", () => {
    held.clear();
    down.clear();
    send({ kind: "blur" });
  });

  const observer = new ResizeObserver(() => {
    const size = pixelSize(canvas);
    ratio = size.pixelRatio;
    send({ kind: "resize", ...size });
  });
  observer.observe(canvas);
  signal.addEventListener("abort", () => observer.disconnect());
}
