/** Light or dark, as the system has it until the user chooses, and the colours of drawings. */

import { recall, remember } from "./dom.ts";

const KEY = "posefield-theme";
const system = () => matchMedia("(prefers-color-scheme: dark)");

type Listener = () => void;
const listeners = new Set<Listener>();

export function isDark(): boolean {
  return document.documentElement.dataset["theme"] === "dark";
}

/** Apply the chosen theme, and follow the system without one. */
export function start(): void {
  const follow = () => apply(recall("localStorage", KEY) ?? (system().matches ? "dark" : "light"));
  system().addEventListener("change", follow);
  follow();
}

export function toggle(): void {
  const next = isDark() ? "light" : "dark";
  remember("localStorage", KEY, next);
  apply(next);
}

function apply(theme: string): void {
  document.documentElement.dataset["theme"] = theme;
  for (const listener of listeners) listener();
}

/** Call whenever colours change, until the signal. */
export function listen(listener: Listener, signal?: AbortSignal): void {
  listeners.add(listener);
  signal?.addEventListener("abort", () => listeners.delete(listener));
}

/** Return the value of a custom property of colours.css. */
export function colour(name: string): string {
  return getComputedStyle(document.documentElement).getPropertyValue(name).trim();
}

/** Return the colour of a level of detail; those beyond the fourth share its colour. */
export function levelColour(level: number): string {
  return colour(`--level-${Math.min(level, 3)}`);
}

/** Tell whether the user wants no motion that starts by itself. */
export function still(): boolean {
  return matchMedia("(prefers-reduced-motion: reduce)").matches;
}
