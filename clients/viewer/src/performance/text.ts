/** The script as text: to be read, changed, saved and opened. */

import { el, id } from "../dom.ts";
import { saveFile } from "../save-file.ts";
import type { Desk } from "./desk.ts";
import { LONGEST_SCRIPT, pretty, read } from "./script.ts";

/** Characters of a file that is opened; a service takes no more either. */
const MOST = 2_000_000;

export function mount(host: HTMLElement, desk: Desk): void {
  const view = new TextView(host, desk);
  desk.listen((change) => {
    if (change === "script") view.show();
  });
}

class TextView {
  readonly #desk: Desk;
  readonly #text = el("textarea", { rows: 10, spellcheck: "false", id: id() });
  readonly #fault = el("p", { class: "fault", role: "alert", id: id() });
  readonly #file = el("input", { type: "file", accept: ".json,application/json", hidden: true });
  readonly #long = el("p", { class: "about" });

  constructor(host: HTMLElement, desk: Desk) {
    this.#desk = desk;
    this.#text.setAttribute("aria-describedby", this.#fault.id);
    this.#text.addEventListener("change", () => this.#take(this.#text.value));
    this.#file.addEventListener("change", () => void this.#opened());
    const save = el("button", { type: "button" }, "Save script");
    save.addEventListener("click", () => this.#save());
    const open = el("button", { type: "button" }, "Open script");
    open.addEventListener("click", () => this.#file.click());
    host.append(
      el("div", { class: "script-file" }, save, open, this.#file),
      this.#long,
      this.#fault,
      el(
        "details",
        { class: "script-text" },
        el("summary", {}, "Script as text"),
        el(
          "label",
          { class: "about", for: this.#text.id },
          "JSON; what you type holds when you leave the field.",
        ),
        this.#text,
      ),
    );
  }

  show(): void {
    const { script, session } = this.#desk;
    if (!script) return;
    this.#text.value = pretty(script);
    this.#say("");
    this.#long.textContent = session.store.state.script.length > LONGEST_SCRIPT ? LONG : "";
  }

  #take(text: string): boolean {
    const found = read(text);
    const wrong = typeof found === "string";
    this.#say(wrong ? found : "");
    if (!wrong) this.#desk.edit(found);
    return !wrong;
  }

  #say(fault: string): void {
    this.#fault.textContent = fault;
    this.#text.setAttribute("aria-invalid", String(fault !== ""));
  }

  #save(): void {
    const { script } = this.#desk;
    if (script)
      saveFile("performance.json", new Blob([pretty(script)], { type: "application/json" }));
  }

  async #opened(): Promise<void> {
    const [file] = this.#file.files ?? [];
    this.#file.value = "";
    if (!file) return;
    if (file.size > MOST) {
      this.#say(`${file.name} has ${file.size} bytes, expected at most ${MOST}.`);
      return;
    }
    const text = await file.text();
    if (!this.#take(text)) this.#say(`${file.name}: ${this.#fault.textContent}`);
  }
}

const LONG = "This script is too long for a link: save it as a file to send it on.";
