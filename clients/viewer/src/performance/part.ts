/** The view of a performance: a script of segments, its timeline, and the whole motion. */

import "./performance.css";
import { el } from "../dom.ts";
import type { Session } from "../session.ts";
import { staged } from "./answers.ts";
import { Desk } from "./desk.ts";
import * as downloads from "./downloads.ts";
import * as floor from "./floor.ts";
import * as list from "./list.ts";
import * as showing from "./showing.ts";
import * as text from "./text.ts";
import * as timeline from "./timeline-view.ts";
import * as whole from "./whole.ts";

/** Which parts of the page are shown hangs on `data-view` of its body (performance.css). */
export function mount(session: Session): void {
  const { signal, source, store } = session;
  const show = () => {
    document.body.dataset["view"] = store.state.view;
  };
  show();
  signal.addEventListener("abort", store.listen(show));
  const side = place("#side", "performance", signal);
  const stage = staged(source);
  if (!stage) {
    side.append(el("h2", {}, "Performance"), el("p", { class: "about" }, NONE));
    return;
  }
  const desk = new Desk(session, stage);
  list.mount(side, desk);
  whole.mount(side, desk);
  downloads.mount(side, desk);
  text.mount(side, desk);
  showing.mount(desk);
  floor.mount(place("#stage", "floor", signal), desk);
  timeline.mount(place("#transport", "timeline", signal), desk);
  desk.begin();
}

const NONE = "A performance needs a service: this page runs without one.";

function place(host: string, part: string, signal: AbortSignal): HTMLElement {
  const made = el("section", { "data-part": part });
  document.querySelector(host)!.append(made);
  signal.addEventListener("abort", () => made.remove());
  return made;
}
