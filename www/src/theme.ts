/** Light or dark: the system's choice until the visitor makes another. Loaded before the first picture, so that none is wrong. */
import { memory } from "./dom.js";

/** The two of them. */
export type Theme = "light" | "dark";

const system = matchMedia("(prefers-color-scheme: dark)");
const root = document.documentElement;
const listeners: ((theme: Theme) => void)[] = [];

function chosen(): Theme | null {
  const value = root.dataset.theme ?? memory.get("theme");
  return value === "light" || value === "dark" ? value : null;
}

/** What is shown now. */
export function theme(): Theme {
  return chosen() ?? (system.matches ? "dark" : "light");
}

/** Shows the other one. Choosing what the system has means following the system again. */
export function toggleTheme(): void {
  const next: Theme = theme() === "dark" ? "light" : "dark";
  const follows = next === (system.matches ? "dark" : "light");
  if (follows) delete root.dataset.theme;
  else root.dataset.theme = next;
  memory.set("theme", follows ? null : next);
  apply();
}

/** Calls back now and at every change. */
export function onTheme(listener: (theme: Theme) => void): void {
  listeners.push(listener);
  listener(theme());
}

function apply(): void {
  const now = theme();
  if (chosen()) root.dataset.theme = now;
  root.toggleAttribute("data-dark", now === "dark");
  for (const listener of listeners) listener(now);
}

system.addEventListener("change", apply);
apply();
