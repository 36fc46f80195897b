/** What is said of each level of detail below its character. */

import type { ModelCard } from "@posefield/client";

import { farEnough, type Ladder, type Lens } from "./detail.ts";
import { el } from "./dom.ts";
import { figure, whole } from "./written.ts";

/** Pixels between joints of two poses: the greatest, and the root mean square. */
export interface Apart {
  readonly most: number;
  readonly rms: number;
}

export class Note {
  readonly host: HTMLElement;
  readonly #level: number;
  readonly #now = el("dd", { class: "levels-now" });
  readonly #from = el("dd");

  constructor(level: number, card: ModelCard) {
    this.#level = level;
    const { bytes, operations, rms, pose, ranks } = card.levels[level]!;
    const rows: [string, HTMLElement][] = [
      ["size", el("dd", {}, `${figure(bytes / 1000)} kB`)],
      ["cost", el("dd", {}, `${whole(operations)} multiply-adds`)],
      ["off by", el("dd", {}, `${short(rms)} cm, worst pose ${short(pose)}`)],
      ["now", this.#now],
      ["≤ 1 px", this.#from],
    ];
    const title = el("h3", {}, `Level ${level}`, el("small", {}, ranks.join(" × ")));
    const list = rows.flatMap(([term, value]) => [el("dt", {}, term), value]);
    this.host = el(
      "article",
      { class: `level-${Math.min(level, 3)}` },
      title,
      el("dl", {}, ...list),
    );
  }

  show(now: Apart, ladder: Ladder, lens: Lens): void {
    const own = `${pixels(now.rms)} px, worst ${pixels(now.most)}`;
    this.#now.textContent = this.#level ? own : "reference";
    this.#from.textContent = `from ${whole(Math.ceil(farEnough(ladder, this.#level, lens)))} m on`;
  }
}

const short = (metres: number): string => String(Number((100 * metres).toPrecision(2)));
const pixels = (value: number): string => value.toFixed(value < 10 ? 1 : 0);
