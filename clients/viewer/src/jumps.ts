/** Buttons that lead to the sections of the side, always in view. */

import { el } from "./dom.ts";
import type { Mount } from "./page.ts";

const SECTIONS = [
  ["controls", "Controls"],
  ["map", "Map"],
  ["files", "Download"],
  ["detail", "Detail"],
] as const;

export const mount: Mount = (host) => {
  const buttons = SECTIONS.map(([part, name]) => {
    const made = el("button", { type: "button", "data-to": part }, name);
    made.addEventListener("click", () => jump(host, part));
    return made;
  });
  host.append(el("nav", { class: "jumps", "aria-label": "Sections" }, ...buttons));
};

/** Scroll to a section, and go on from there with the keyboard. */
function jump(host: HTMLElement, part: string): void {
  const section = host.parentElement?.querySelector<HTMLElement>(`[data-part="${part}"]`);
  if (!section) return;
  section.tabIndex = -1;
  section.focus({ preventScroll: true });
  section.scrollIntoView();
}
