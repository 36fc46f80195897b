/** The clip that is shown as a file, or as text that asks for it. */

import { type Client, type ClipFormat, type ClipQuestion, PosefieldError } from "@posefield/client";

import "./files.css";
import { curl, fileName, link, python, type Wanted } from "./code-texts.ts";
import { chooser, el, labelled } from "./dom.ts";
import { type Page, served } from "./page.ts";
import { saveFile } from "./save-file.ts";
import type { Session } from "./session.ts";
import { title } from "./slider.ts";
import type { State } from "./state.ts";
import { TAKE_AND_FEET, takeAndFeet, whyFeetCannotStand } from "./takes.ts";
import { videoButton } from "./video-button.ts";
import { figure } from "./written.ts";

const FORMATS = [
  ["usdc", "USD, binary (.usdc)"],
  ["usda", "USD, text (.usda)"],
  ["usdz", "USD package (.usdz)"],
  ["glb", "glTF (.glb)"],
  ["bvh", "BVH (.bvh)"],
  ["npz", "NumPy (.npz)"],
  ["json", "JSON (.json)"],
] as const;
const NAMES = [
  ["own", "as captured"],
  ["mixamo", "Mixamo"],
  ["ue5", "Unreal 5"],
  ["vrm", "VRM"],
  ["humanik", "HumanIK"],
] as const;
const WAYS = [
  ["travelling", "travels"],
  ["in_place", "stays in place"],
] as const;
const USUAL = ["", "default"] as const;
const UNITS = [USUAL, ["m", "metres"], ["cm", "centimetres"]] as const;
const UPS = [USUAL, ["y", "Y"], ["z", "Z"]] as const;
const TEXTS = { curl, python, link } as const;

type Text = keyof typeof TEXTS;
type Names = (typeof NAMES)[number][0];

/** What this part alone decides; the rest is as it is shown. */
interface Choice {
  format: ClipFormat;
  fps: number;
  loop: boolean;
  names: Names;
  unit: "" | "m" | "cm";
  up: "" | "y" | "z";
  exact: "auto" | "none";
  text: Text;
}

export function mount(host: HTMLElement, session: Session): void {
  if (served(session.source)) {
    new Files(host, session, session.source).begin();
    return;
  }
  const said = el("p", { class: "files-said", role: "status" }, NONE);
  const video = videoButton(session, (text) => {
    said.textContent = text;
  });
  host.append(titled(said, el("div", { class: "files-main" }, video)));
}

const NONE =
  "Animation files need a service: this page runs without one, on answers computed beforehand. A video can be recorded.";

function titled(...content: readonly HTMLElement[]): HTMLElement {
  return el(
    "section",
    { class: "files", "aria-label": "Download" },
    el("h2", {}, "Download"),
    ...content,
  );
}

class Files {
  readonly #page: Page;
  readonly #service: Pick<Client, "file">;
  readonly #choice: Choice;
  readonly #get = el("button", { type: "button", class: "files-get" });
  readonly #said = el("p", { class: "files-said" });
  readonly #code = el("pre", { tabindex: 0 });
  readonly #shows: (() => void)[] = [];
  #asked: AbortController | null = null;

  constructor(host: HTMLElement, session: Session, service: Pick<Client, "file">) {
    const page = session;
    this.#page = page;
    this.#service = service;
    const fps = page.card.rate >= 1 && page.card.rate <= 60 ? page.card.rate : 30;
    this.#choice = {
      format: "usdc",
      fps,
      loop: false,
      names: "own",
      unit: "",
      up: "",
      exact: "auto",
      text: "curl",
    };
    this.#said.setAttribute("role", "status");
    this.#code.setAttribute("aria-label", "Text to copy");
    const texts = (["curl", "python", "link"] as const).map((text) => this.#tab(text));
    const copy = el("button", { type: "button" }, "Copy");
    copy.addEventListener("click", () => void this.#copy());
    const kinds = el("div", { class: "files-kinds", role: "group" }, ...texts, copy);
    kinds.setAttribute("aria-label", "Ask for it by");
    host.append(
      titled(
        el(
          "div",
          { class: "files-main" },
          this.#get,
          videoButton(session, (text) => this.#say(text)),
        ),
        this.#said,
        el("div", { class: "files-fields" }, ...this.#rows()),
        ...this.#holds(),
        el("h3", {}, "The same from a program"),
        kinds,
        this.#code,
      ),
    );
  }

  begin(): void {
    const { store, signal } = this.#page;
    this.#get.addEventListener("click", () => {
      if (this.#asked) this.#asked.abort();
      else void this.#download();
    });
    const stop = store.listen((_, changed) => this.#changed(changed));
    signal.addEventListener("abort", () => {
      stop();
      this.#asked?.abort();
    });
    this.#draw();
  }

  get #wanted(): Wanted {
    const { model } = this.#page.store.state;
    const { format } = this.#choice;
    // Who serves the page serves the files.
    return { base: location.origin, model, format, question: this.#question };
  }

  /** What differs from what is usual, so that texts stay short. */
  get #question(): ClipQuestion {
    const { card, source, store } = this.#page;
    const { controls, labels, performer, level, root } = store.state;
    const { fps, loop, names, unit, up, format, exact } = this.#choice;
    const targets = this.#targets;
    const measured = format === "glb" ? {} : { ...(unit && { unit }), ...(up && { up }) };
    return {
      controls,
      fps,
      ...(performer !== null && { performer }),
      ...(Object.keys(labels).length && { labels }),
      ...(level && { level }),
      ...(root === "in_place" && { root }),
      ...(loop && { loop }),
      ...(targets && { targets }),
      ...takeAndFeet(source, card, store.state),
      ...(exact !== "auto" && { exact }),
      ...(names !== "own" && { names }),
      ...measured,
    };
  }

  /** The target of the page's handle, for the file to meet exactly. */
  get #targets(): ClipQuestion["targets"] | null {
    const { card, store } = this.#page;
    const { target } = store.state;
    if (!target || !card.event) return null;
    const joint = card.skeleton.names[card.event.joint]!;
    const position = target.map((value) => Number(value.toFixed(4)));
    return [{ joint, at: "event", position }];
  }

  #changed(changed: ReadonlySet<keyof State>): void {
    const drawn = ["root", "level", "target", ...TAKE_AND_FEET] as const;
    if (drawn.some((key) => changed.has(key))) this.#draw();
    else if (["controls", "performer", "labels"].some((key) => changed.has(key as "labels")))
      this.#tell();
  }

  #take(part: Partial<Choice>): void {
    Object.assign(this.#choice, part);
    this.#draw();
  }

  #draw(): void {
    for (const show of this.#shows) show();
    for (const button of this.#host("[data-text]")) {
      button.setAttribute("aria-pressed", String(button.dataset["text"] === this.#choice.text));
    }
    this.#tell();
  }

  #host(what: string): HTMLElement[] {
    return [...(this.#code.parentElement?.querySelectorAll<HTMLElement>(what) ?? [])];
  }

  /** A list to choose from, which follows what is chosen elsewhere. */
  #list<Value extends string>(
    word: string,
    options: readonly (readonly [Value, string])[],
    now: () => string,
    take: (value: Value) => void,
  ): HTMLElement {
    const list = chooser(options, now(), (value) => take(value as Value));
    this.#shows.push(() => {
      list.value = now();
    });
    return labelled(word, list);
  }

  #rows(): HTMLElement[] {
    const { card, store } = this.#page;
    const choice = this.#choice;
    const levels = card.levels.map((_, i) => [String(i), `${i}`] as const);
    const rows = [
      this.#list(
        "Format",
        FORMATS,
        () => choice.format,
        (format) => this.#take({ format }),
      ),
      this.#rate(),
      this.#list(
        "Movement",
        WAYS,
        () => store.state.root,
        (root) => store.set({ root }),
      ),
      this.#list(
        "Level of detail",
        levels,
        () => String(store.state.level),
        (level) => store.set({ level: Number(level) }),
      ),
    ];
    if (Object.keys(card.roles).length)
      rows.push(
        this.#list(
          "Joint names",
          NAMES,
          () => choice.names,
          (names) => this.#take({ names }),
        ),
      );
    const measures = [
      this.#list(
        "Unit",
        UNITS,
        () => choice.unit,
        (unit) => this.#take({ unit }),
      ),
      this.#list(
        "Up axis",
        UPS,
        () => choice.up,
        (up) => this.#take({ up }),
      ),
    ];
    // glTF says itself what its units and its up are.
    this.#shows.push(() => {
      for (const row of measures) row.hidden = choice.format === "glb";
    });
    rows.push(...measures);
    return rows;
  }

  #rate(): HTMLElement {
    const field = el("input", { type: "number", min: "1", max: "1000", step: "any" });
    const show = () => {
      field.value = String(this.#choice.fps);
    };
    field.addEventListener("change", () => {
      const value = Number(field.value);
      if (value >= 1 && value <= 1000) this.#take({ fps: value });
      else show();
    });
    show();
    return labelled("Frames a second", field);
  }

  #cycle(): HTMLElement {
    return check("Closed loop", (loop) => this.#take({ loop }));
  }

  /** As the stage has it. */
  #standing(): HTMLElement {
    const { store } = this.#page;
    const row = check("Feet stand where they contact the ground", (stands) =>
      store.set({ stands }),
    );
    this.#shows.push(() => {
      row.querySelector("input")!.checked = store.state.stands;
    });
    return row;
  }

  /** What the file holds exactly, where the shown motion only comes near. */
  #holds(): HTMLElement[] {
    const { card, store } = this.#page;
    const rows: HTMLElement[] = card.cyclic ? [this.#cycle()] : [];
    if (!whyFeetCannotStand(card)) rows.push(this.#standing());
    const measured = card.controls.filter(({ measure }) => measure).map(({ name }) => title(name));
    if (measured.length) {
      const words = `Match exactly: ${measured.join(", ")}`;
      rows.push(check(words, (on) => this.#take({ exact: on ? "auto" : "none" }), true));
    }
    if (card.event && !card.cyclic) {
      const line = el("p", { class: "about" });
      this.#shows.push(() => {
        line.textContent = store.state.target ? TARGET : "";
      });
      rows.push(line);
    }
    return rows;
  }

  #tab(text: Text): HTMLButtonElement {
    const name = { curl: "curl", python: "Python", link: "Link" }[text];
    const button = el("button", { type: "button" }, name);
    button.dataset["text"] = text;
    button.addEventListener("click", () => this.#take({ text }));
    return button;
  }

  #tell(): void {
    this.#get.textContent = this.#asked ? "Stop" : `Download ${fileName(this.#wanted)}`;
    this.#code.textContent = TEXTS[this.#choice.text](this.#wanted);
  }

  async #copy(): Promise<void> {
    try {
      await navigator.clipboard.writeText(this.#code.textContent);
      this.#say("Copied.");
    } catch {
      getSelection()?.selectAllChildren(this.#code);
      this.#say(
        "This browser does not let pages use the clipboard: the text is selected, copy it yourself.",
      );
    }
  }

  /** Asks for the whole file and only then hands it to the browser. */
  async #download(): Promise<void> {
    const { signal } = this.#page;
    const wanted = this.#wanted;
    this.#asked = new AbortController();
    this.#say(`Requesting ${fileName(wanted)} …`);
    this.#tell();
    try {
      const both = AbortSignal.any([signal, this.#asked.signal]);
      const { content, mediaType } = await this.#service.file(
        wanted.model,
        wanted.format,
        wanted.question,
        both,
      );
      saveFile(fileName(wanted), new Blob([content], { type: mediaType }));
      this.#say(`${fileName(wanted)} saved: ${size(content.length)}.`);
    } catch (fault) {
      this.#say(this.#asked.signal.aborted ? "Stopped; nothing was saved." : failed(fault));
    } finally {
      this.#asked = null;
      this.#tell();
    }
  }

  #say(text: string): void {
    this.#said.textContent = text;
  }
}

function failed(fault: unknown): string {
  const said = fault instanceof PosefieldError ? fault.message : String(fault);
  return `Nothing was saved: ${said}`;
}

const size = (bytes: number): string =>
  bytes < 1e6 ? `${figure(bytes / 1e3)} kB` : `${figure(bytes / 1e6)} MB`;

const TARGET = "The file meets the target above exactly, where the joint can reach it.";

/** A box to tick, with its words after it. */
function check(words: string, taken: (on: boolean) => void, on = false): HTMLElement {
  const box = el("input", { type: "checkbox", checked: on });
  box.addEventListener("change", () => taken(box.checked));
  return el("label", { class: "files-check" }, box, el("span", {}, words));
}
