/** The map in words, numbers and a legend, for users who do not see it. */

import type { ModelCard, SigmaGrid } from "@posefield/client";

import { captured, extent, viridis } from "./chart.ts";
import { el } from "./dom.ts";
import type { Control } from "./examples.ts";
import { figure, precise } from "./written.ts";

interface Legend {
  readonly host: HTMLElement;
  show(grid: SigmaGrid, card: ModelCard): void;
}

/** Legend of the colours in centimetres, the rings and the stripes. */
export function legend(): Legend {
  const canvas = { width: 256, height: 1, class: "map-scale", "aria-hidden": "true" };
  const bar = el("canvas", canvas);
  const pen = bar.getContext("2d")!;
  const image = pen.createImageData(256, 1);
  for (let i = 0; i < 256; i++) {
    viridis(i / 255, image.data, 4 * i);
    image.data[4 * i + 3] = 255;
  }
  pen.putImageData(image, 0, 0);
  const numbers = el("div", { class: "map-numbers" });
  const stripes = el("div", { class: "map-stripes" }, STRIPES);
  const rings = el("div", { class: "map-rings" });
  const host = el("div", { class: "map-legend" }, bar, numbers, stripes, rings);
  const show = (grid: SigmaGrid, card: ModelCard) => {
    const [low, high] = extent(grid);
    const [least, middle, most] = [low, (low + high) / 2, high].map((value) => figure(100 * value));
    numbers.replaceChildren(
      el("span", {}, `${least} cm`),
      el("span", {}, `sigma ${middle}`),
      el("span", {}, `${most} cm and more`),
    );
    const worst = Math.max(0, ...(card.left_out ?? []));
    const ring = worst
      ? `, a ring as wide as its error when left out, up to ${precise(worst)}`
      : "";
    rings.textContent = `A dot is a captured clip${ring}; faint where other controls differ.`;
  };
  return { host, show };
}

const STRIPES =
  "Hatched: nothing like it was captured. Dashed: the ranges that were sampled, which may hold gaps.";

/** Say where sigma is least and greatest in the part with support, and how large that part is. */
export function summary(grid: SigmaGrid, [across, along]: readonly [Control, Control]): string {
  const supported = captured(grid);
  const cells = grid.along_values.flatMap((y, row) =>
    grid.across_values.map((x, column) => ({
      x,
      y,
      row,
      column,
      sigma: grid.sigma[row]![column]!,
    })),
  );
  const near = cells.filter(({ row, column }) => supported[row]![column]);
  if (!near.length)
    return "Nothing like any of this map was captured: another control lies too far off.";
  const sorted = near.toSorted((a, b) => a.sigma - b.sigma);
  const [least, most] = [sorted[0]!, sorted.at(-1)!];
  const at = ({ x, y }: (typeof cells)[number]) =>
    `at ${across.name} ${figure(x)} ${across.unit}, ${along.name} ${figure(y)} ${along.unit}`;
  const part = figure(Math.round((100 * near.length) / cells.length));
  return (
    `Within what was captured, ${part} % of this map, sigma is least, ${precise(least.sigma)}, ${at(least)}, ` +
    `and greatest, ${precise(most.sigma)}, ${at(most)}.`
  );
}

const STEPS = 6;

/** Table of some rows and columns: sigma in centimetres, a star without support. */
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
  const title = `Sigma in cm; * nothing like it was captured. Columns: ${across.name}, rows: ${along.name}.`;
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
