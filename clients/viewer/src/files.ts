/** Downloads: the shown clip as a file, a video, and text that asks for the same. */

import { type ClipFormat, type ClipQuestion, PosefieldError } from "@posefield/client";

import { curl, fileName, link, python, type Wanted } from "./code-texts.ts";
import { checkbox, chooser, el, labelled, saveFile, textButton } from "./dom.ts";
import type { Control } from "./examples.ts";
import type { Session } from "./player.ts";
import { TAKE_AND_FEET, takeAndFeet, targetFields } from "./questions.ts";
import { type Changes, has, valuesOf } from "./state.ts";
import { videoButton } from "./video.ts";
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
const TEXTS = { curl, python, link } as const;
const TEXT_NAMES = [
  ["curl", "curl"],
  ["python", "Python"],
  ["link", "Link"],
] as const;

/** Settings of this part; the rest of the question is as the page shows it. */
interface Choice {
  format: ClipFormat;
  fps: number;
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
  readonly #code = el("pre", { tabindex: 0, "aria-label": "Text to copy" });
  /** Each shows a field as the choice and the state are now. */
  readonly #shows: (() => void)[] = [];
  #request: AbortController | null = null;

  constructor(host: HTMLElement, session: Session) {
    this.#session = session;
    const { card, signal, store } = session;
    this.#choice = {
      format: "usdc",
      fps: card.rate >= 1 && card.rate <= 60 ? card.rate : 30,
      loop: false,
      names: "own",
      unit: "",
      up: "",
      exact: true,
      text: "curl",
    };
    const texts = TEXT_NAMES.map(([text, name]) => {
      const element = textButton(name, () => this.#take({ text }));
      element.dataset["text"] = text;
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
        el(
          "div",
          { class: "files-main row" },
          this.#get,
          videoButton(session, (text) => this.#say(text)),
        ),
        this.#status,
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
    // Files come from the service that the page comes from.
    const base = location.origin;
    return { base, model, format: this.#choice.format, question: this.#question };
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

  /** Controls that are measured on a motion, not on the performer's body. */
  get #measured(): string[] {
    const of = ({ measure }: Control) => measure?.quantity ?? "stature";
    const { controls } = this.#session.card;
    return controls.filter((c) => !BODY.has(of(c))).map(({ name }) => name);
  }

  #update(changed: Changes): void {
    if (has(changed, "root", "level", "target", ...TAKE_AND_FEET)) this.#show();
    else if (has(changed, "controls", "inferred", "performer", "labels")) this.#showTexts();
  }

  #take(part: Partial<Choice>): void {
    Object.assign(this.#choice, part);
    this.#show();
  }

  #show(): void {
    for (const show of this.#shows) show();
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
    const fps = el("input", { type: "number", min: 1, max: 1000, step: "any" });
    fps.addEventListener("change", () => {
      const value = Number(fps.value);
      this.#take(value >= 1 && value <= 1000 ? { fps: value } : {});
    });
    this.#shows.push(() => {
      fps.value = String(this.#choice.fps);
    });
    const measures = [this.#choose("Unit", "unit", UNITS), this.#choose("Up axis", "up", UPS)];
    // The units and axes of glTF are fixed.
    this.#shows.push(() => {
      for (const field of measures) field.hidden = this.#choice.format === "glb";
    });
    return [
      this.#choose("Format", "format", FORMATS),
      labelled("Frames a second", fps),
      ...(Object.keys(card.roles).length ? [this.#choose("Joint names", "names", NAMES)] : []),
      ...measures,
    ];
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
      const { content, mediaType } = await service.client.file(model, format, question, either);
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
