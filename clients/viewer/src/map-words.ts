/** What the map shows in words, numbers and a legend, for those who do not see it. */

import type { ModelCard, SigmaGrid } from "@posefield/client";

import { type Control, captured, extent } from "./chart.ts";
import { viridis } from "./colours.ts";
import { el } from "./dom.ts";
import { figure, precise } from "./written.ts";

interface Legend {
  readonly host: HTMLElement;
  show(grid: SigmaGrid, card: ModelCard): void;
}

/** The scale of colours in centimetres, and what a ring and stripes mean. */
export function legend(): Legend {
  const bar = el("canvas", { width: 256, height: 1, class: "map-scale" });
  bar.setAttribute("aria-hidden", "true");
  const pen = bar.getContext("2d")!;
  const image = pen.createImageData(256, 1);
  for (let i = 0; i < 256; i++) {
    viridis(i / 255, image.data, 4 * i);
    image.data[4 * i + 3] = 255;
  }
  pen.putImageData(image, 0, 0);
  const numbers = el("div", { class: "map-numbers" });
  const stripes = el("div", { class: "map-stripes" });
  const rings = el("div", { class: "map-rings" });
  const host = el("div", { class: "map-legend" }, bar, numbers, stripes, rings);
  const show = (grid: SigmaGrid, card: ModelCard) => {
    scale(numbers, grid);
    stripes.textContent = grid.supported ? STRIPES : "Hatched: never sampled.";
    rings.textContent = dots(card);
  };
  return { host, show };
}

const STRIPES =
  "Hatched: nothing like it was captured. Dashed: the ranges that were sampled, which may hold gaps.";

function scale(numbers: HTMLElement, grid: SigmaGrid): void {
  const [low, high] = extent(grid);
  const [least, middle, most] = [low, (low + high) / 2, high].map((value) => figure(100 * value));
  numbers.replaceChildren(
    el("span", {}, `${least} cm`),
    el("span", {}, `sigma ${middle}`),
    el("span", {}, `${most} cm and more`),
  );
}

function dots(card: ModelCard): string {
  const worst = Math.max(0, ...(card.left_out ?? []));
  const ring = worst ? `, a ring as wide as its error when left out, up to ${precise(worst)}` : "";
  return `A dot is a captured clip${ring}; faint where other controls differ.`;
}

/** A sentence on where sigma is least and greatest within what was captured, and how much of the map
 * that is. */
export function said(grid: SigmaGrid, [across, along]: readonly [Control, Control]): string {
  const found = [...cells(grid)].filter(({ near }) => near);
  if (!found.length) return grid.supported ? NOWHERE : BEYOND;
  const [first] = found;
  let [least, most] = [first!, first!];
  for (const cell of found) {
    if (cell.sigma < least.sigma) least = cell;
    if (cell.sigma > most.sigma) most = cell;
  }
  const at = ({ x, y }: Cell) =>
    `at ${across.name} ${figure(x)} ${across.unit}, ${along.name} ${figure(y)} ${along.unit}`;
  const of = grid.supported ? `captured, ${percent(found.length, grid)} of this map,` : "sampled";
  return (
    `Within what was ${of} sigma is least, ${precise(least.sigma)}, ${at(least)}, ` +
    `and greatest, ${precise(most.sigma)}, ${at(most)}.`
  );
}

const NOWHERE = "Nothing like any of this map was captured: another control lies too far off.";
const BEYOND = "All of this map lies outside what was sampled: another control does.";

function percent(count: number, grid: SigmaGrid): string {
  return `${figure(Math.round((100 * count) / grid.sigma.flat().length))} %`;
}

interface Cell {
  readonly x: number;
  readonly y: number;
  readonly sigma: number;
  /** Whether anything like it was captured. */
  readonly near: boolean;
}

function* cells(grid: SigmaGrid): Generator<Cell> {
  const known = captured(grid);
  for (const [row, y] of grid.along_values.entries()) {
    for (const [column, x] of grid.across_values.entries()) {
      yield { x, y, sigma: grid.sigma[row]![column]!, near: known[row]![column]! };
    }
  }
}

const STEPS = 6;

/** Some of the grid's rows and columns: sigma in centimetres, a star where nothing like it was
 * captured. */
export function table(
  grid: SigmaGrid,
  [across, along]: readonly [Control, Control],
): HTMLElement[] {
  const pick = (count: number) =>
    Array.from({ length: STEPS }, (_, i) => Math.round((i * (count - 1)) / (STEPS - 1)));
  const columns = pick(grid.across_values.length);
  const rows = pick(grid.along_values.length).reverse();
  const heading = (value: number, scope: string) => el("th", { scope }, figure(value));
  const known = captured(grid);
  const star = grid.supported ? "nothing like it was captured" : "lies outside what was sampled";
  const title = `Sigma in cm; * ${star}. Columns: ${across.name}, rows: ${along.name}.`;
  const head = el(
    "tr",
    {},
    el("td"),
    ...columns.map((column) => heading(grid.across_values[column]!, "col")),
  );
  const body = rows.map((row) =>
    el(
      "tr",
      {},
      heading(grid.along_values[row]!, "row"),
      ...columns.map((column) => {
        const text = figure(100 * grid.sigma[row]![column]!);
        return el("td", {}, known[row]![column] ? text : `${text} *`);
      }),
    ),
  );
  return [el("caption", {}, title), el("thead", {}, head), el("tbody", {}, ...body)];
}
