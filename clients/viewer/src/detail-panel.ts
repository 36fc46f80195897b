/** Levels of detail: which is shown, and a comparison of all on the stage. */

import { chooser, el, labelled, toggle } from "./dom.ts";
import type { Mount } from "./page.ts";

export const mount: Mount = (host, { card, signal, store }) => {
  const levels = card.levels.map(
    (_, level) => [String(level), level ? String(level) : "0, finest"] as const,
  );
  const level = chooser(levels, String(store.state.level), (value) =>
    store.set({ level: Number(value) }),
  );
  const compare = toggle("Compare all", "Compare all", (on) =>
    store.set({ view: on ? "levels" : "one" }),
  );
  const show = () => {
    level.value = String(store.state.level);
    compare.set(store.state.view === "levels");
  };
  host.append(
    el("h2", {}, "Detail"),
    el("p", { class: "about" }, ABOUT),
    el("div", { class: "detail-row" }, labelled("Level", level), compare),
  );
  show();
  signal.addEventListener("abort", store.listen(show));
};

const ABOUT =
  "Coarser levels cost less and differ slightly from level 0. They are meant for characters far from the camera.";
