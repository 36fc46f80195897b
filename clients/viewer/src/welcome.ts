/** A headline and a hint on the first visit, until it is closed or a control is moved. */

import { button, el } from "./dom.ts";
import type { Mount } from "./page.ts";

const KEPT = "posefield-welcomed";

export const mount: Mount = (host, { signal, store }) => {
  host.hidden = welcomed();
  if (host.hidden) return;
  const close = () => {
    keep();
    host.hidden = true;
  };
  host.append(
    el(
      "div",
      { class: "welcome", role: "note" },
      el("div", {}, el("h2", {}, "Motion from a few sliders"), el("p", {}, HINT)),
      button("Close", "Close this hint", close),
    ),
  );
  const leave = store.listen((_, changed) => {
    if (["controls", "performer", "labels"].some((key) => changed.has(key as "labels"))) close();
  });
  signal.addEventListener("abort", leave);
};

const HINT = "Move a slider and the motion follows. Download it for Blender, Unreal or Maya.";

function welcomed(): boolean {
  try {
    return localStorage.getItem(KEPT) !== null;
  } catch {
    // Without storage the hint would come back on every visit.
    return true;
  }
}

function keep(): void {
  try {
    localStorage.setItem(KEPT, "yes");
  } catch {
    // Without storage it is not shown again either.
  }
}
