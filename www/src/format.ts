/** Numbers as people read them. */
import type { PixelSize } from "./ipdrecon/index.js";

/** Bytes in the unit that leaves at most three digits. */
export function bytes(n: number): string {
  if (n < 1e6) return `${Math.max(1, Math.round(n / 1e3))} kB`;
  return n < 1e9 ? `${Math.round(n / 1e6)} MB` : `${(n / 1e9).toFixed(1)} GB`;
}

/** A time span. */
export function seconds(s: number): string {
  if (s < 10) return `${s.toFixed(1)} s`;
  return s < 60 ? `${Math.round(s)} s` : `${Math.floor(s / 60)} min ${Math.round(s % 60)} s`;
}

/** A time span that is foretold, no more exactly than it is known. */
export function about(s: number): string {
  const steps = s < 10 ? 1 : s < 60 ? 5 : s < 600 ? 30 : 300;
  const rounded = Math.max(1, Math.round(s / steps)) * steps;
  return `about ${rounded < 60 ? `${rounded} s` : `${Number((rounded / 60).toFixed(1))} min`}`;
}

/** A length given in metres, in centimetres. */
export function centimetres(m: number): string {
  return `${Number((m * 100).toFixed(1))} cm`;
}

/** A picture's size. */
export function pixels({ widthPx, heightPx }: PixelSize): string {
  return `${widthPx} × ${heightPx}`;
}

/** A number that came through f32, as it was meant: 0.03999999910593033 is 0.04. */
export function plain(n: number): number {
  return Number(n.toPrecision(6));
}
