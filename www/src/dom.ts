/** The few lines between this page and the DOM. */

/** The element of the page with this id. */
export function byId<T extends HTMLElement = HTMLElement>(id: string): T {
  const element = document.getElementById(id);
  if (!element) throw new Error(`index.html has no #${id}`);
  return element as T;
}

/** Writes text, only where it changes: a write is a layout. */
export function write(element: HTMLElement, text: string): void {
  if (element.textContent !== text) element.textContent = text;
}

/** A new element with text. */
export function make<K extends keyof HTMLElementTagNameMap>(tag: K, text = "", className = ""): HTMLElementTagNameMap[K] {
  const element = document.createElement(tag);
  element.textContent = text;
  element.className = className;
  return element;
}

/** Terms and their values into a `<dl>`. */
export function list(dl: HTMLElement, rows: readonly (readonly [term: string, value: string])[]): void {
  dl.replaceChildren(...rows.flatMap(([term, value]) => [make("dt", term), make("dd", value)]));
}

/** Hands a file to the visitor. */
export function save(file: File): void {
  const link = make("a");
  link.href = URL.createObjectURL(file);
  link.download = file.name;
  link.click();
  // The download has its own hold on the data once it has begun.
  setTimeout(() => URL.revokeObjectURL(link.href), 60_000);
}

/** What this browser remembers for the visitor; nothing where it may not remember. */
export const memory = {
  get(key: string): string | null {
    try {
      return localStorage.getItem(`ipdrecon.${key}`);
    } catch {
      return null;
    }
  },
  set(key: string, value: string | null): void {
    try {
      if (value === null) localStorage.removeItem(`ipdrecon.${key}`);
      else localStorage.setItem(`ipdrecon.${key}`, value);
    } catch {
      // Private windows may refuse; the choice then holds until the page is closed.
    }
  },
};
