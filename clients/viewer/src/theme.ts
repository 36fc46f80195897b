/** Light or dark: as the system has it, until somebody says otherwise. */

const KEPT = "posefield-theme";
const dark = () => matchMedia("(prefers-color-scheme: dark)");

type Listener = () => void;
const listeners = new Set<Listener>();

export function isDark(): boolean {
  const said = document.documentElement.dataset["theme"];
  return said ? said === "dark" : dark().matches;
}

/** Applies what was said last time. */
export function start(): void {
  const kept = stored();
  if (kept) document.documentElement.dataset["theme"] = kept;
  dark().addEventListener("change", tell);
}

export function toggle(): void {
  const next = isDark() ? "light" : "dark";
  document.documentElement.dataset["theme"] = next;
  try {
    localStorage.setItem(KEPT, next);
  } catch {
    // Where nothing may be kept, it holds until the page is closed.
  }
  tell();
}

/** Told whenever colours change, until the signal. */
export function listen(listener: Listener, signal?: AbortSignal): void {
  listeners.add(listener);
  signal?.addEventListener("abort", () => listeners.delete(listener));
}

/** What a custom property of style.css says now. */
export function colour(name: string): string {
  return getComputedStyle(document.documentElement).getPropertyValue(name).trim();
}

export function still(): boolean {
  return matchMedia("(prefers-reduced-motion: reduce)").matches;
}

function tell(): void {
  for (const listener of listeners) listener();
}

function stored(): string | null {
  try {
    return localStorage.getItem(KEPT);
  } catch {
    return null;
  }
}
