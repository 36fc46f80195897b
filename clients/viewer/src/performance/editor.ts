/** The script as JSON, checked by the service, with each fault at its line; files of it and of the motion. */

import { chooser, el, id, labelled, saveFile, textButton, titled } from "../dom.ts";
import { FORMATS, failedText, savedText } from "../files.ts";
import { centimetres, seconds } from "../written.ts";
import type { Performance } from "./performance.ts";
import { LONGEST_SCRIPT, lineOf, type Note, pretty, read, spanOf } from "./script.ts";

/** Milliseconds without a keystroke until the script is performed. */
const REST = 500;
/** Bytes of a file that is opened; the service takes no more either. */
const MOST = 2_000_000;
const ALL_FORMATS = [
  ...FORMATS,
  ["arrow", "Arrow (.arrow)"],
  ["msgpack", "MessagePack (.msgpack)"],
] as const;
type Format = (typeof ALL_FORMATS)[number][0];

export function mount(host: HTMLElement, performance: Performance): void {
  new Editor(host, performance);
}

class Editor {
  readonly #performance: Performance;
  readonly #length = el("strong", { "data-duration": "" });
  readonly #status = el("p", { class: "performance-said", role: "status" });
  readonly #notes = el("ul", { class: "notes", id: id() });
  readonly #text = el("textarea", {
    rows: 16,
    spellcheck: "false",
    "aria-label": "Script as JSON",
    "aria-describedby": this.#notes.id,
  });
  readonly #file = el("input", { type: "file", accept: ".json,application/json", hidden: true });
  readonly #download = textButton("", () => void this.#save(), "act");
  readonly #saved = el("p", { class: "about saved", role: "status" });
  #format: Format = "usdc";
  #timer: ReturnType<typeof setTimeout> | undefined;

  constructor(host: HTMLElement, performance: Performance) {
    this.#performance = performance;
    const { signal } = performance.session;
    this.#text.addEventListener("input", () => {
      clearTimeout(this.#timer);
      this.#timer = setTimeout(() => this.#take(), REST);
    });
    this.#text.addEventListener("change", () => this.#take());
    this.#file.addEventListener("change", () => void this.#openFile());
    signal.addEventListener("abort", () => clearTimeout(this.#timer));
    const save = textButton("Save script", () =>
      saveFile("performance.json", new Blob([this.#text.value], { type: "application/json" })),
    );
    const open = textButton("Open script", () => this.#file.click());
    const formats = chooser(ALL_FORMATS, this.#format, (format) => {
      this.#format = format as Format;
      this.#showAnswer();
    });
    host.append(
      titled("Performance", el("span", {}, this.#length)),
      el("p", { class: "about" }, ABOUT),
      ...[this.#status, this.#text, this.#notes],
      el("div", { class: "row" }, save, open, this.#file),
      el("div", { class: "performance-file" }, labelled("Format", formats), this.#download),
      this.#saved,
    );
    performance.listen((change) => {
      if (change === "script") this.#showScript();
      if (change === "answer") this.#showAnswer();
    });
  }

  /** Show a script that was changed elsewhere, as by the address. */
  #showScript(): void {
    const { script } = this.#performance.session.store.state;
    const now = read(this.#text.value);
    if (typeof now !== "string" && JSON.stringify(now) === script) return;
    const wanted = read(script);
    if (typeof wanted !== "string") this.#text.value = pretty(wanted);
  }

  /** Perform the text, or say what is wrong with it. */
  #take(): void {
    clearTimeout(this.#timer);
    const script = read(this.#text.value);
    if (typeof script === "string") {
      this.#showNotes([{ pointer: "", words: script, fault: true }]);
      return;
    }
    const text = JSON.stringify(script);
    const { store } = this.#performance.session;
    if (text === store.state.script) this.#showAnswer();
    else store.set({ script: text });
  }

  #showAnswer(): void {
    const { busy, notes, refused, report, session } = this.#performance;
    this.#length.textContent = report ? seconds(report.duration) : "";
    this.#download.textContent = `Download performance.${this.#format}`;
    this.#download.disabled = refused || !report;
    this.#status.toggleAttribute("data-refused", refused && !busy);
    if (busy) this.#status.textContent = "Computing the motion …";
    else if (refused)
      this.#status.textContent = "This script cannot be performed; the last motion stays.";
    else if (report) {
      const count = report.segments.length;
      const support = report.supported ? "captured near all of it" : "parts are a guess";
      this.#status.textContent = `${count} segment${count === 1 ? "" : "s"}, σ ${centimetres(report.sigma)}, ${support}.`;
    }
    const long = session.store.state.script.length > LONGEST_SCRIPT;
    this.#showNotes(long ? [...notes, LONG] : notes);
  }

  /** List the notes, each as a button that selects its place in the text. */
  #showNotes(notes: readonly Note[]): void {
    const { value } = this.#text;
    const valid = typeof read(value) !== "string";
    const items = notes.map(({ pointer, words, fault }) => {
      const placed = valid && pointer !== "";
      const [first, last] = placed ? spanOf(value, pointer) : [0, 0];
      const text = placed ? `Line ${lineOf(value, first)}, ${pointer}: ${words}` : words;
      const select = () => {
        this.#text.focus();
        this.#text.setSelectionRange(first, last);
      };
      const kind = { "data-note": fault ? "fault" : "warning" };
      return el("li", kind, placed ? textButton(text, select) : text);
    });
    this.#notes.replaceChildren(...items);
    this.#text.setAttribute("aria-invalid", String(notes.some(({ fault }) => fault)));
  }

  async #openFile(): Promise<void> {
    const [file] = this.#file.files ?? [];
    this.#file.value = "";
    if (!file) return;
    if (file.size > MOST) {
      const words = `${file.name} has ${file.size} bytes, expected at most ${MOST}.`;
      this.#showNotes([{ pointer: "", words, fault: true }]);
      return;
    }
    this.#text.value = await file.text();
    this.#take();
  }

  async #save(): Promise<void> {
    const { service, signal, store } = this.#performance.session;
    const name = `performance.${this.#format}`;
    const script = read(store.state.script);
    if (typeof script === "string") return;
    this.#saved.textContent = `Requesting ${name} …`;
    try {
      const client = service.performances;
      const { content, mediaType } = await client.performanceFile(this.#format, script, { signal });
      saveFile(name, new Blob([content], { type: mediaType }));
      this.#saved.textContent = savedText(name, content.length);
    } catch (fault) {
      if (!signal.aborted) this.#saved.textContent = failedText(fault);
    }
  }
}

const ABOUT =
  "A script is a list of segments: walks of models that travel, acts of models without cycle, and holds. The service checks it as you type.";
const LONG: Note = {
  pointer: "",
  words: "This script is too long for a link: save it as a file to send it on.",
  fault: false,
};
