/** The segments of a script in their order; the chosen one shows its fields. */

import { button, el } from "../dom.ts";
import * as written from "../written.ts";
import type { Desk } from "./desk.ts";
import type { Fields } from "./fields.ts";
import { added, type Kind, moved, removed, type Segment } from "./script.ts";
import { segmentFields, shape } from "./segment-fields.ts";
import { joinWords, notesOf, plainName, within } from "./timeline.ts";

const KINDS = [
  ["walk", "Walk"],
  ["act", "Act"],
  ["hold", "Hold"],
] as const;

export function mount(host: HTMLElement, desk: Desk): void {
  const list = new List(host, desk);
  desk.listen((change) => {
    if (change === "script" || change === "selected") list.draw();
    if (change === "answer") list.tell();
  });
  void desk.models.ready().then(() => list.renew());
}

class List {
  readonly #desk: Desk;
  readonly #host = el("ol", { class: "segments", "aria-label": "Segments" });
  readonly #said = el("p", { class: "performance-said", role: "status" });
  readonly #general = el("ul", { class: "notes" });
  readonly #length = el("strong", { "data-duration": "" });
  #drawn = "";
  #fields: Fields | null = null;

  constructor(host: HTMLElement, desk: Desk) {
    this.#desk = desk;
    const adds = KINDS.map(([kind, word]) =>
      button(`+ ${word}`, `Add a ${kind} after the chosen segment`, () => void this.#add(kind)),
    );
    host.append(
      el("div", { class: "title" }, el("h2", {}, "Performance"), el("span", {}, this.#length)),
      el("p", { class: "about" }, ABOUT),
      this.#said,
      this.#general,
      this.#host,
      el("div", { class: "adds", role: "group", "aria-label": "Add a segment" }, ...adds),
    );
  }

  /** Made anew, with the models that are known by now. */
  renew(): void {
    this.#drawn = "";
    this.draw();
  }

  draw(): void {
    const { script, selected } = this.#desk;
    if (!script) return;
    const drawn = `${selected} ${script.segments.map(shape).join(" ")}`;
    if (drawn !== this.#drawn) {
      this.#drawn = drawn;
      const kept = focused(this.#host);
      this.#fields = null;
      this.#host.replaceChildren(...script.segments.map((segment, i) => this.#row(segment, i)));
      refocus(this.#host, kept);
    } else this.#fields?.show();
    this.tell();
  }

  /** What the newest answer says of each segment. */
  tell(): void {
    const { busy, notes, refused, report, script } = this.#desk;
    const count = script?.segments.length ?? 0;
    this.#length.textContent = report && !refused ? written.seconds(report.duration) : "";
    const faults = notes.filter(({ fault }) => fault).length;
    const words = refused
      ? REFUSED + (this.#desk.performed ? STAYS : "")
      : `${counted(count, "segment")}${notes.length ? `, ${counted(notes.length, "remark")}` : ""}.`;
    if (!busy && this.#said.textContent !== words) this.#said.textContent = script ? words : "";
    this.#said.toggleAttribute("data-refused", faults > 0);
    this.#general.replaceChildren(
      ...notesOf(notes, null, count).map(({ words, fault }) => item(words, fault)),
    );
    [...this.#host.children].forEach((row, index) => {
      this.#note(row as HTMLElement, index, count);
    });
  }

  #note(row: HTMLElement, index: number, count: number): void {
    const { notes, refused, report } = this.#desk;
    const own = notesOf(notes, index, count);
    const made = own.map(({ words, fault, pointer }) => item(words, fault, within(pointer)));
    const found = refused ? undefined : report?.segments[index];
    const join = refused ? undefined : report?.joins.find(({ segment }) => segment === index);
    if (join) made.unshift(item(joinWords(join), join.hard, "", !join.hard));
    for (const { what, miss, reached } of found?.targets ?? [])
      if (!reached)
        made.push(item(`${what} misses its target by ${written.centimetres(miss)}.`, false));
    row.querySelector(".notes")!.replaceChildren(...made);
    row.querySelector(".span")!.textContent = found
      ? `${found.begins.toFixed(1)} to ${written.seconds(found.ends)}`
      : "";
    row.dataset["notes"] = own.some(({ fault }) => fault) ? "fault" : own.length ? "warning" : "";
    const wrong = own.filter(({ fault }) => fault).map(({ pointer }) => within(pointer));
    for (const field of row.querySelectorAll<HTMLElement>("input[data-at], select[data-at]")) {
      const at = field.dataset["at"]!;
      const told = wrong.some((place) => place === at || place.startsWith(`${at}/`));
      if (told) {
        field.dataset["told"] = "";
        field.setAttribute("aria-invalid", "true");
      } else if (field.dataset["told"] !== undefined) {
        delete field.dataset["told"];
        field.removeAttribute("aria-invalid");
      }
    }
  }

  #row(segment: Segment, index: number): HTMLElement {
    const desk = this.#desk;
    const chosen = index === desk.selected;
    const name = segment.kind === "hold" ? "" : plainName(segment.model);
    const word = segment.kind[0]!.toUpperCase() + segment.kind.slice(1);
    const open = el(
      "button",
      {
        type: "button",
        class: "open",
        "aria-expanded": String(chosen),
        "data-at": `${index}/open`,
      },
      el("b", {}, `${index + 1} ${word}`),
      el("span", { class: "model" }, name),
      el("span", { class: "span" }),
    );
    open.addEventListener("click", () => desk.select(index));
    const row = el(
      "li",
      { "data-kind": segment.kind, "data-chosen": chosen },
      el("div", { class: "segment-head" }, open, ...this.#moves(index)),
    );
    row.append(el("ul", { class: "notes" }));
    if (chosen) {
      this.#fields = segmentFields(desk, index);
      row.append(this.#fields.element);
    }
    return row;
  }

  #moves(index: number): HTMLElement[] {
    const desk = this.#desk;
    const script = desk.script!;
    const last = script.segments.length - 1;
    const up = button("↑", `Move segment ${index + 1} up`, () => this.#move(index, -1));
    const down = button("↓", `Move segment ${index + 1} down`, () => this.#move(index, 1));
    const remove = button("×", `Delete segment ${index + 1}`, () =>
      desk.edit(removed(desk.script!, index), Math.max(0, Math.min(index, last - 1))),
    );
    up.disabled = index === 0;
    down.disabled = index === last;
    remove.disabled = last === 0;
    for (const [made, word] of [
      [up, "up"],
      [down, "down"],
      [remove, "delete"],
    ] as const)
      made.dataset["at"] = `${index}/${word}`;
    return [up, down, remove];
  }

  #move(index: number, by: -1 | 1): void {
    const desk = this.#desk;
    desk.edit(moved(desk.script!, index, by), index + by);
    // The hand that moved it stays with it.
    const word = by < 0 ? "up" : "down";
    this.#host.querySelector<HTMLElement>(`[data-at="${index + by}/${word}"]`)?.focus();
  }

  async #add(kind: Kind): Promise<void> {
    const desk = this.#desk;
    const { script, selected } = desk;
    if (!script) return;
    const segment = await desk.models.made(kind, script);
    if (typeof segment === "string") this.#said.textContent = segment;
    else desk.edit(added(desk.script!, selected, segment), selected + 1);
  }
}

const ABOUT =
  "One motion through segments: walks, acts of other models, and holds. Choose one to change it.";
const REFUSED = "This script cannot be performed.";
const STAYS = " The last motion that could be stays.";

function counted(count: number, word: string): string {
  return `${count} ${word}${count === 1 ? "" : "s"}`;
}

/** plain: neither a fault nor a warning. */
function item(words: string, fault: boolean, at = "", plain = false): HTMLElement {
  const kind = fault ? "fault" : plain ? "plain" : "warning";
  return el("li", { "data-note": kind, "data-about": at || null }, words);
}

function focused(host: HTMLElement): string | null {
  const at = document.activeElement;
  return at instanceof HTMLElement && host.contains(at) ? (at.dataset["at"] ?? null) : null;
}

function refocus(host: HTMLElement, at: string | null): void {
  if (at === null) return;
  const found = [...host.querySelectorAll<HTMLElement>("[data-at]")].find(
    (each) => each.dataset["at"] === at,
  );
  (found ?? host.querySelector<HTMLElement>("[aria-expanded=true]"))?.focus();
}
