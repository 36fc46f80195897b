/** The section of the side that tells of motion files, with the button for those who drag nothing. */

import { el } from "../dom.ts";
import { NAMES } from "./accepted.ts";
import { ProbePanel } from "./panel.ts";

let panel: ProbePanel | null = null;

/** The dialog, which stays where the parts are mounted anew. */
function shared(): ProbePanel {
  panel ??= new ProbePanel(document.body);
  return panel;
}

/** Takes files that are dropped, whatever is shown. */
export function listen(): void {
  shared();
}

export function mount(host: HTMLElement): void {
  const choose = el("button", { type: "button", class: "probe-choose" }, "Choose files…");
  choose.addEventListener("click", () => shared().choose());
  host.append(
    el(
      "section",
      { class: "probe-part", "aria-label": "Motion files" },
      el("h2", {}, "Motion files"),
      choose,
      el(
        "p",
        { class: "about" },
        `What is this file? Drop ${NAMES} anywhere on the page. ${LOCAL}`,
      ),
    ),
  );
}

const LOCAL = "It is read in this browser; nothing is uploaded.";
