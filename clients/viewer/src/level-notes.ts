/** What is said of each level of detail below its character. */

import type { ModelCard } from "@posefield/client";

import { farEnough, type Ladder, type Lens } from "./detail.ts";
import { element, figure, whole } from "./markup.ts";

/** Pixels between joints of two poses: the greatest, and the root mean square. */
export interface Apart {
  readonly most: number;
  readonly rms: number;
}

export class Note {
  readonly host: HTMLElement;
  readonly #level: number;
  readonly #now = element("dd", { className: "levels-now" });
  readonly #from = element("dd");

  constructor(level: number, card: ModelCard) {
    this.#level = level;
    const { bytes, operations, rms, pose, ranks } = card.levels[level]!;
    const rows: [string, HTMLElement][] = [
      ["size", element("dd", {}, `${figure(bytes / 1000)} kB`)],
      ["cost", element("dd", {}, `${whole(operations)} multiply-adds`)],
      ["off by", element("dd", {}, `${short(rms)} cm, worst pose ${short(pose)}`)],
      ["now", this.#now],
      ["≤ 1 px", this.#from],
    ];
    const title = element("h3", {}, `Level ${level}`, element("small", {}, ranks.join(" × ")));
    const list = rows.flatMap(([term, value]) => [element("dt", {}, term), value]);
    this.host = element(
      "article",
      { className: `level-${Math.min(level, 3)}` },
      title,
      element("dl", {}, ...list),
    );
  }

  show(now: Apart, ladder: Ladder, lens: Lens): void {
    const own = `${pixels(now.rms)} px, worst ${pixels(now.most)}`;
    this.#now.textContent = this.#level ? own : "the measure of the others";
    this.#from.textContent = `from ${whole(Math.ceil(farEnough(ladder, this.#level, lens)))} m on`;
  }
}

const short = (metres: number): string => String(Number((100 * metres).toPrecision(2)));
const pixels = (value: number): string => value.toFixed(value < 10 ? 1 : 0);
