/** The parts of the page, in their places. */

import * as bodies from "./bodies.ts";
import * as controls from "./controls.ts";
import * as copy from "./copy-note.ts";
import * as crowd from "./crowd.ts";
import * as curves from "./curves.ts";
import * as detail from "./detail-panel.ts";
import * as fan from "./fan.ts";
import * as feet from "./feet.ts";
import * as files from "./files.ts";
import * as ghost from "./ghost.ts";
import * as jumps from "./jumps.ts";
import * as keys from "./keys.ts";
import * as levels from "./levels.ts";
import * as map from "./map.ts";
import * as options from "./options.ts";
import * as performance from "./performance/part.ts";
import * as probe from "./probe/part.ts";
import type { Session } from "./session.ts";
import * as takes from "./takes-panel.ts";
import * as target from "./target.ts";
import * as transport from "./transport.ts";
import * as trust from "./trust.ts";
import * as welcome from "./welcome.ts";

type Part = (host: HTMLElement, session: Session) => void;

/** Their labels, one over the other. */
function ghosts(host: HTMLElement, session: Session): void {
  ghost.mount(host, session);
  fan.mount(host, session);
}

/** Each gets a section of its own, in this order, named for styles and tests. */
const PLACES: Readonly<Record<"stage" | "side" | "transport", Readonly<Record<string, Part>>>> = {
  stage: {
    options: options.mount,
    ghost: ghosts,
    levels: levels.mount,
    crowd: crowd.mount,
  },
  side: {
    jumps: jumps.mount,
    welcome: welcome.mount,
    copy: copy.mount,
    controls: controls.mount,
    takes: takes.mount,
    trust: trust.mount,
    curves: curves.mount,
    target: target.mount,
    map: map.mount,
    feet: feet.mount,
    files: files.mount,
    detail: detail.mount,
    probe: probe.mount,
  },
  transport: { time: transport.mount },
};

/** Until the session's signal. */
export function mount(session: Session): void {
  bodies.mount(session);
  keys.mount(session);
  for (const [place, parts] of Object.entries(PLACES)) {
    const host = document.querySelector(`#${place}`)!;
    for (const [name, part] of Object.entries(parts)) {
      const section = document.createElement("section");
      section.dataset["part"] = name;
      host.append(section);
      session.signal.addEventListener("abort", () => section.remove());
      part(section, session);
    }
  }
  performance.mount(session);
}
