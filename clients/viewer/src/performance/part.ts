/** The view of a performance: script, floor plan, timeline and the whole motion. */

import "./performance.css";
import { el } from "../dom.ts";
import type { Session } from "../player.ts";
import * as editor from "./editor.ts";
import * as floorPlan from "./floor-plan.ts";
import { Performance } from "./performance.ts";
import * as stage from "./stage.ts";
import * as timeline from "./timeline.ts";

export function mount(session: Session): void {
  const { signal, store } = session;
  // performance.css shows the parts by the view.
  store.follow(({ view }) => {
    document.body.dataset["view"] = view;
  }, signal);
  const section = (area: string, part: string): HTMLElement => {
    const element = el("section", { "data-part": part });
    document.querySelector(area)!.append(element);
    signal.addEventListener("abort", () => element.remove());
    return element;
  };
  const performance = new Performance(session);
  const side = section("#side", "performance");
  editor.mount(side, performance);
  floorPlan.mount(side, performance);
  stage.mount(performance);
  timeline.mount(section("#transport", "timeline"), performance);
  performance.begin();
}
