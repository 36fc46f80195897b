/** Downloads: the shown clip or crowd as a file, and text that asks for the same. */

import {
  type ClipFormat,
  type ClipQuestion,
  type CrowdFormat,
  PosefieldError,
  type WalkQuestion,
} from "@posefield/client";

import { curl, fileName, link, ofCrowd, python, type Wanted } from "./code-texts.ts";
import { checkbox, chooser, el, labelled, numberField, saveFile, textButton } from "./dom.ts";
import type { Session } from "./player.ts";
import {
  LARGEST_SEED,
  standsByDefault,
  TAKE_AND_FEET,
  takeAndFeet,
  targetFields,
} from "./questions.ts";
import { type Changes, has, valuesOf } from "./state.ts";
import { figure, title } from "./written.ts";

export const FORMATS = [
  ["usdc", "USD, binary (.usdc)"],
  ["usda", "USD, text (.usda)"],
  ["usdz", "USD package (.usdz)"],
  ["glb", "glTF (.glb)"],
  ["bvh", "BVH (.bvh)"],
  ["npz", "NumPy (.npz)"],
  ["json", "JSON (.json)"],
] as const;
const CROWDS: readonly string[] = ["usdc", "usda", "usdz"] satisfies CrowdFormat[];
const NAMES = [
  ["own", "as captured"],
  ["mixamo", "Mixamo"],
  ["ue5", "Unreal 5"],
  ["vrm", "VRM"],
  ["humanik", "HumanIK"],
] as const;
const BODY: ReadonlySet<string> = new Set(["leg_length", "stature"]);
const DEFAULT = ["", "default"] as const;
const UNITS = [DEFAULT, ["m", "metres"], ["cm", "centimetres"]] as const;
const UPS = [DEFAULT, ["y", "Y"], ["z", "Z"]] as const;
const TEXTS = { curl, Python: python, Link: link } as const;

const PATHS = "The seed decides the paths of the file, which are not those of the stage.";
const STANDING = "There is no file of this crowd: this model does not walk.";

/** Settings of this part; the rest of the question is as the page shows it. */
interface Choice {
  format: ClipFormat;
  fps: number;
  /** Of a crowd. */
  seconds: number;
  seed: number;
  loop: boolean;
  names: (typeof NAMES)[number][0];
  unit: (typeof UNITS)[number][0];
  up: (typeof UPS)[number][0];
  exact: boolean;
  text: keyof typeof TEXTS;
}

export function mount(host: HTMLElement, session: Session): void {
  new Files(host, session);
}

class Files {
  readonly #session: Session;
  readonly #choice: Choice;
  readonly #get = textButton("", () => this.#getOrStop(), "act files-get");
  readonly #status = el("p", { class: "files-said", role: "status" });
  readonly #paths = el("p", { class: "about" });
  readonly #code = el("pre", { tabindex: 0, "aria-label": "Text to copy" });
  /** Each shows a field as the choice and the state are now. */
  readonly #shows: (() => void)[] = [];
  /** Controls that are measured on a motion, not on the performer's body. */
  readonly #measured: readonly string[];
  #request: AbortController | null = null;

  constructor(host: HTMLElement, session: Session) {
    this.#session = session;
    const { card, signal, store } = session;
    this.#measured = card.controls
      .filter(({ measure }) => measure && !BODY.has(measure.quantity))
      .map(({ name }) => name);
    this.#choice = {
      format: "usdc",
      fps: card.rate >= 1 && card.rate <= 60 ? card.rate : 30,
      seconds: 5,
      seed: 0,
      loop: false,
      names: "own",
      unit: "",
      up: "",
      exact: true,
      text: "curl",
    };
    const texts = (Object.keys(TEXTS) as (keyof typeof TEXTS)[]).map((text) => {
      const element = textButton(text, () => this.#take({ text }));
      this.#shows.push(() =>
        element.setAttribute("aria-pressed", String(this.#choice.text === text)),
      );
      return element;
    });
    const copy = textButton("Copy", () => void this.#copy());
    host.append(
      el(
        "section",
        { class: "files", "aria-label": "Download" },
        el("h2", {}, "Download"),
        ...[this.#get, this.#status, this.#paths],
        el("div", { class: "files-fields" }, ...this.#fields()),
        ...this.#options(),
        el("h3", {}, "The same from a program"),
        el(
          "div",
          { class: "files-kinds row", role: "group", "aria-label": "Ask for it by" },
          ...[...texts, copy],
        ),
        this.#code,
      ),
    );
    store.listen((_, changed) => this.#update(changed), signal);
    signal.addEventListener("abort", () => this.#request?.abort());
    this.#show();
  }

  get #wanted(): Wanted {
    const { model } = this.#session.store.state;
    const { format } = this.#choice;
    // Files come from the service that the page comes from.
    const rest = { base: location.origin, model };
    if (!this.#crowd) return { ...rest, format, question: this.#question };
    return { ...rest, format: CROWDS.includes(format) ? format : "usdc", question: this.#walk };
  }

  get #crowd(): boolean {
    return this.#session.store.state.view === "crowd";
  }

  /** The question for the crowd of the stage, on paths that the service chooses. */
  get #walk(): WalkQuestion {
    const { card, store } = this.#session;
    const { crowd: count, level, stands, varied } = store.state;
    const { fps, seconds, seed } = this.#choice;
    return {
      ...{ count, seconds, fps, seed },
      ...(varied && { take: "index" as const }),
      ...(level && { level }),
      ...(stands !== standsByDefault(card) && { feet: stands ? "stand" : "as_predicted" }),
    };
  }

  /** The question with the values that differ from defaults, so that texts stay short. */
  get #question(): ClipQuestion {
    const { card, store } = this.#session;
    const { controls, labels, performer, level, root } = store.state;
    const { fps, loop, names, unit, up, format, exact } = this.#choice;
    // The motion on the stage matches measured controls that were set, not those inferred.
    const measured = this.#measured;
    const matched = exact ? measured.filter((name) => Object.hasOwn(controls, name)) : [];
    return {
      controls: valuesOf(store.state),
      fps,
      ...(performer !== null && { performer }),
      ...(Object.keys(labels).length && { labels }),
      ...(level && { level }),
      ...(root === "in_place" && { root }),
      ...(loop && { loop }),
      ...targetFields(card, store.state),
      ...takeAndFeet(card, store.state),
      ...(matched.length < measured.length && { exact: matched.length ? matched : "none" }),
      ...(names !== "own" && { names }),
      ...(unit && format !== "glb" && { unit }),
      ...(up && format !== "glb" && { up }),
    };
  }

  #update(changed: Changes): void {
    if (has(changed, "view", "crowd", "varied", "root", "level", "target", ...TAKE_AND_FEET))
      this.#show();
    else if (has(changed, "controls", "inferred", "performer", "labels")) this.#showTexts();
  }

  #take(part: Partial<Choice>): void {
    Object.assign(this.#choice, part);
    this.#show();
  }

  #show(): void {
    for (const show of this.#shows) show();
    const { cyclic, root } = this.#session.card;
    const walks = cyclic && root === "travelling";
    this.#get.disabled = this.#crowd && !walks;
    this.#paths.textContent = walks ? PATHS : STANDING;
    this.#paths.hidden = !this.#crowd;
    this.#showTexts();
  }

  #showTexts(): void {
    this.#get.textContent = this.#request ? "Stop" : `Download ${fileName(this.#wanted)}`;
    this.#code.textContent = TEXTS[this.#choice.text](this.#wanted);
  }

  /** A list for a value of the choice. */
  #choose<Key extends "format" | "names" | "unit" | "up">(
    word: string,
    key: Key,
    options: readonly (readonly [Choice[Key] & string, string])[],
  ): HTMLElement {
    const list = chooser(options, this.#choice[key], (value) => this.#take({ [key]: value }));
    return labelled(word, list);
  }

  #fields(): HTMLElement[] {
    const { card } = this.#session;
    const formats = this.#choose("Format", "format", FORMATS);
    const seconds = this.#number("Seconds", "seconds", { min: 0.1, max: 600, step: 0.1 });
    const seed = this.#number("Seed of paths", "seed", { min: 0, max: LARGEST_SEED, step: 1 });
    const names = this.#choose("Joint names", "names", NAMES);
    const measures = [this.#choose("Unit", "unit", UNITS), this.#choose("Up axis", "up", UPS)];
    this.#shows.push(() => {
      // The units and axes of glTF are fixed.
      for (const field of measures) field.hidden = this.#crowd || this.#choice.format === "glb";
      names.hidden = this.#crowd || !Object.keys(card.roles).length;
      seconds.hidden = seed.hidden = !this.#crowd;
      const list = formats.querySelector("select")!;
      for (const option of list.options)
        option.hidden = this.#crowd && !CROWDS.includes(option.value);
      list.value = this.#wanted.format;
    });
    const fps = this.#number("Frames a second", "fps", { min: 1, max: 1000, step: 0.01 });
    return [formats, fps, seconds, seed, names, ...measures];
  }

  /** A number of the choice. */
  #number(
    word: string,
    key: "fps" | "seconds" | "seed",
    range: Parameters<typeof numberField>[1],
  ): HTMLElement {
    const field = numberField(word, range, (value) => this.#take({ [key]: value }));
    this.#shows.push(() => field.set(this.#choice[key]));
    return field;
  }

  #options(): HTMLElement[] {
    const { card, store } = this.#session;
    const rows: HTMLElement[] = [];
    const measured = this.#measured.map(title);
    if (card.cyclic) rows.push(checkbox("Closed loop", (loop) => this.#take({ loop })));
    if (measured.length) {
      const box = checkbox(`Match exactly: ${measured.join(", ")}`, (exact) =>
        this.#take({ exact }),
      );
      box.set(true);
      rows.push(box);
    }
    if (card.event && !card.cyclic) {
      const line = el("p", { class: "about" });
      this.#shows.push(() => {
        line.textContent = store.state.target
          ? "The file meets the target above exactly, where the joint can reach it."
          : "";
      });
      rows.push(line);
    }
    this.#shows.push(() => {
      for (const row of rows) row.hidden = this.#crowd;
    });
    return rows;
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

  #getOrStop(): void {
    if (this.#request) this.#request.abort();
    else void this.#download();
  }

  /** Fetch the whole file, and only then let the browser save it. */
  async #download(): Promise<void> {
    const { service, signal } = this.#session;
    const wanted = this.#wanted;
    const name = fileName(wanted);
    const request = new AbortController();
    this.#request = request;
    this.#say(`Requesting ${name} …`);
    this.#showTexts();
    try {
      const { model, format, question } = wanted;
      const either = AbortSignal.any([signal, request.signal]);
      const { content, mediaType } = await (ofCrowd(question)
        ? service.performances.crowdFile(model, format as CrowdFormat, question, { signal: either })
        : service.client.file(model, format, question, either));
      saveFile(name, new Blob([content], { type: mediaType }));
      this.#say(savedText(name, content.length));
    } catch (fault) {
      this.#say(request.signal.aborted ? "Stopped; nothing was saved." : failedText(fault));
    } finally {
      this.#request = null;
      this.#showTexts();
    }
  }

  #say(text: string): void {
    this.#status.textContent = text;
  }
}

export function savedText(name: string, bytes: number): string {
  const size = bytes < 1e6 ? `${figure(bytes / 1e3)} kB` : `${figure(bytes / 1e6)} MB`;
  return `${name} saved: ${size}.`;
}

export function failedText(fault: unknown): string {
  return `Nothing was saved: ${fault instanceof PosefieldError ? fault.message : fault}`;
}
