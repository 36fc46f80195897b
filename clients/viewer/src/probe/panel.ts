/** Motion files by drag and drop or by a button: a dialog says what they are. Nothing leaves the browser. */

import "./panel.css";
import { button, el, id } from "../dom.ts";
import { ACCEPTED, NAMES } from "./accepted.ts";
import { MOST_FILES, readFiles } from "./reading.ts";
import type { Fact, Report } from "./report.ts";

const LOCAL = "Files are read in this browser; nothing is uploaded.";
const MORE =
  "posefield probe says the same on the command line, and roles of joints, feet and facing besides.";

export class ProbePanel {
  readonly #title = el("h2", { id: id() }, "Motion files");
  readonly #said = el("p", { class: "probe-said", role: "status", "aria-live": "polite" });
  readonly #reports = el("div", { class: "probe-reports" });
  readonly #choose = el("input", { type: "file", multiple: true, accept: ACCEPTED, hidden: true });
  readonly #dialog: HTMLDialogElement;
  readonly #veil = el("div", { class: "probe-veil", hidden: true, "aria-hidden": "true" });
  #reading = new AbortController();

  constructor(host: HTMLElement) {
    const close = button("Close", "Close", () => this.#dialog.close());
    const other = el("button", { type: "button" }, "Choose other files…");
    other.addEventListener("click", () => this.choose());
    this.#dialog = el(
      "dialog",
      { class: "probe", "aria-labelledby": this.#title.id },
      el("div", { class: "probe-head" }, this.#title, other, close),
      this.#said,
      this.#reports,
      el("p", { class: "about" }, `${LOCAL} ${MORE}`),
    );
    this.#dialog.addEventListener("close", () => this.#reading.abort());
    this.#veil.append(
      el("p", {}, `Drop ${NAMES} files to see what they are. Nothing is uploaded.`),
    );
    this.#choose.addEventListener("change", () => {
      const files = [...(this.#choose.files ?? [])];
      this.#choose.value = "";
      if (files.length) void this.show(files);
    });
    host.append(this.#dialog, this.#choose, this.#veil);
    this.#listen();
  }

  /** Asks for files. */
  choose(): void {
    this.#choose.click();
  }

  async show(files: readonly File[]): Promise<void> {
    this.#reading.abort();
    const reading = new AbortController();
    this.#reading = reading;
    this.#reports.replaceChildren();
    if (!this.#dialog.open) this.#dialog.showModal();
    const found: Report[] = [];
    const begin = (name: string) => this.#say(`Reading ${name} …`);
    const take = (report: Report) => {
      found.push(report);
      this.#reports.append(article(report));
    };
    await readFiles(files, begin, take, reading.signal);
    if (reading.signal.aborted) return;
    const left =
      files.length > MOST_FILES ? ` The first ${MOST_FILES} of ${files.length} files.` : "";
    this.#say(summary(found) + left);
  }

  #say(text: string): void {
    this.#said.textContent = text;
  }

  /** Files that are dragged over the page, and nothing else that is. */
  #listen(): void {
    const held = (event: DragEvent) => event.dataTransfer?.types.includes("Files") ?? false;
    addEventListener("dragover", (event) => {
      if (!held(event)) return;
      event.preventDefault();
      this.#veil.hidden = false;
    });
    addEventListener("dragleave", (event) => {
      // Without a place that it goes to, it has left the window.
      if (!event.relatedTarget) this.#veil.hidden = true;
    });
    addEventListener("drop", (event) => {
      if (!held(event)) return;
      event.preventDefault();
      this.#veil.hidden = true;
      const files = [...(event.dataTransfer?.files ?? [])];
      if (files.length) void this.show(files);
    });
  }
}

function summary(found: readonly Report[]): string {
  if (found.length === 1) {
    const [{ file, said, refused }] = found as [Report];
    return refused ? `${file} is not read: ${said}` : `${file}: ${said}.`;
  }
  const refused = found.filter((report) => report.refused).length;
  return `${found.length} files${refused ? `, ${refused} of them not read` : ""}.`;
}

function article(report: Report): HTMLElement {
  const { file, said, refused, facts, warnings, notes } = report;
  const rows = facts.flatMap(row);
  return el(
    "article",
    { class: "probe-report", "data-refused": refused },
    el("h3", {}, file),
    el("p", { class: refused ? "fault" : "probe-kind" }, said),
    ...(warnings.length
      ? [el("ul", { class: "warnings" }, ...warnings.map((each) => el("li", {}, each)))]
      : []),
    ...(rows.length ? [el("dl", {}, ...rows)] : []),
    ...notes.map((each) => el("p", { class: "about" }, `Note: ${each}`)),
  );
}

function row({ key, word, value, confidence, evidence }: Fact): HTMLElement[] {
  const sure = confidence ? [el("span", { class: "about" }, ` (confidence: ${confidence})`)] : [];
  const said = evidence.map((each) => el("li", {}, each));
  return [
    el("dt", {}, word),
    el(
      "dd",
      { "data-fact": key },
      el("span", {}, value),
      ...sure,
      ...(said.length ? [el("ul", { class: "about" }, ...said)] : []),
    ),
  ];
}
