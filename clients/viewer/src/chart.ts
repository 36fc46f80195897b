/** A map's drawing: sigma as colours, captured clips as dots, and where one is. */

import type { ModelCard, SigmaGrid } from "@posefield/client";

import { viridis } from "./colours.ts";
import * as hatch from "./hatch.ts";
import * as theme from "./theme.ts";
import type { Veil } from "./veil.ts";
import { figure } from "./written.ts";

export type Control = ModelCard["controls"][number];

/** How far the map goes beyond what was sampled, as a share of it. */
export const MARGIN = 0.25;
const [LEFT, RIGHT, TOP, BOTTOM] = [46, 10, 10, 34];
const [DOT, RING] = [2.5, 7];

/** A captured clip on the map; `error` is the share of the largest, `near` 1 where one is. */
export interface Dot {
  readonly index: number;
  readonly at: readonly [number, number];
  readonly error: number;
  readonly near: number;
}

/** Values of two controls as places on a canvas of a size in CSS pixels, and back. */
export class Frame {
  readonly left = LEFT;
  readonly top = TOP;
  readonly width: number;
  readonly height: number;
  readonly #controls: readonly [Control, Control];

  constructor(across: Control, along: Control, width: number, height: number) {
    this.#controls = [across, along];
    this.width = Math.max(1, width - LEFT - RIGHT);
    this.height = Math.max(1, height - TOP - BOTTOM);
  }

  x(value: number): number {
    return this.left + this.width * share(this.#controls[0], value);
  }

  y(value: number): number {
    return this.top + this.height * (1 - share(this.#controls[1], value));
  }

  /** The values at a place, within the map. */
  values(x: number, y: number): [number, number] {
    const [across, along] = this.#controls;
    return [
      valued(across, (x - this.left) / this.width),
      valued(along, 1 - (y - this.top) / this.height),
    ];
  }

  get range(): [number, number, number, number] {
    const [a, b] = this.#controls;
    const [x, y] = [this.x(a.minimum), this.y(b.maximum)];
    return [x, y, this.x(a.maximum) - x, this.y(b.minimum) - y];
  }
}

function share(control: Control, value: number): number {
  const size = control.maximum - control.minimum;
  return ((value - control.minimum) / size + MARGIN) / (1 + 2 * MARGIN);
}

function valued(control: Control, place: number): number {
  const size = control.maximum - control.minimum;
  const found =
    control.minimum + size * (Math.min(1, Math.max(0, place)) * (1 + 2 * MARGIN) - MARGIN);
  return rounded(found, size);
}

/** To a thousandth of the range, so that numbers stay short. */
export function rounded(value: number, range: number): number {
  const step = 10 ** Math.floor(Math.log10(range / 1000));
  return Number((Math.round(value / step) * step).toPrecision(10));
}

/** For each row and column whether anything like it was captured; whether all was sampled, where
 * an older service says that alone. */
export function captured(grid: SigmaGrid): readonly (readonly boolean[])[] {
  return grid.supported ?? grid.inside;
}

/** Least and greatest sigma, m, within what was captured; beyond, colours are the last one. */
export function extent(grid: SigmaGrid): [number, number] {
  const all = grid.sigma.flat();
  const near = captured(grid).flat();
  const known = all.filter((_, i) => near[i]);
  const counted = known.length ? known : all;
  return [Math.min(...counted), Math.max(...counted)];
}

/** A picture of one pixel a number, which the canvas stretches smoothly. */
export function heat(grid: SigmaGrid): HTMLCanvasElement {
  const [low, high] = extent(grid);
  const [rows, columns] = [grid.sigma.length, grid.sigma[0]!.length];
  const canvas = Object.assign(document.createElement("canvas"), { width: columns, height: rows });
  const pen = canvas.getContext("2d")!;
  const image = pen.createImageData(columns, rows);
  for (let row = 0; row < rows; row++) {
    for (let column = 0; column < columns; column++) {
      // Rows go up, pictures down.
      const at = 4 * ((rows - 1 - row) * columns + column);
      viridis((grid.sigma[row]![column]! - low) / (high - low || 1), image.data, at);
      image.data[at + 3] = 255;
    }
  }
  pen.putImageData(image, 0, 0);
  return canvas;
}

export interface Drawing {
  readonly frame: Frame;
  readonly controls: readonly [Control, Control];
  readonly picture: HTMLCanvasElement | null;
  /** Where nothing like it was captured; null where the service does not say. */
  readonly veil: Veil | null;
  /** Whether the controls that are no axes lie inside what was sampled. */
  readonly inside: boolean;
  readonly dots: readonly Dot[];
  readonly point: readonly [number, number];
  readonly chosen: number | null;
}

export function draw(pen: CanvasRenderingContext2D, it: Drawing): void {
  const { frame } = it;
  pen.save();
  pen.beginPath();
  pen.rect(frame.left, frame.top, frame.width, frame.height);
  pen.fillStyle = theme.colour("--line");
  pen.fill();
  pen.clip();
  if (it.picture) stretch(pen, it.picture, frame);
  if (it.veil) hatch.unsupported(pen, frame, it.veil);
  else hatch.unsampled(pen, frame, it.inside);
  for (const dot of it.dots) mark(pen, frame, dot, dot.index === it.chosen);
  cross(pen, frame, it.point);
  pen.restore();
  axes(pen, it);
}

/** Numbers stand in the middle of their pixels, so the picture's border lies outside the map. */
function stretch(pen: CanvasRenderingContext2D, picture: HTMLCanvasElement, frame: Frame): void {
  const [w, h] = [frame.width / (picture.width - 1), frame.height / (picture.height - 1)];
  pen.imageSmoothingEnabled = true;
  pen.imageSmoothingQuality = "high";
  const size = [frame.width + w, frame.height + h] as const;
  pen.drawImage(picture, frame.left - w / 2, frame.top - h / 2, ...size);
}

function mark(pen: CanvasRenderingContext2D, frame: Frame, dot: Dot, chosen: boolean): void {
  const [x, y] = [frame.x(dot.at[0]), frame.y(dot.at[1])];
  pen.globalAlpha = chosen ? 1 : 0.3 + 0.7 * dot.near;
  circle(pen, x, y, DOT);
  pen.fillStyle = chosen ? "#ff7a1a" : "#fff";
  pen.fill();
  pen.strokeStyle = "#111c";
  pen.lineWidth = 1;
  pen.stroke();
  if (dot.error > 0) {
    circle(pen, x, y, DOT + 1 + RING * dot.error);
    pen.strokeStyle = chosen ? "#ff7a1a" : "#fff9";
    pen.lineWidth = chosen ? 2 : 1;
    pen.stroke();
  }
  pen.globalAlpha = 1;
}

function cross(
  pen: CanvasRenderingContext2D,
  frame: Frame,
  point: readonly [number, number],
): void {
  const [x, y] = [frame.x(point[0]), frame.y(point[1])];
  for (const [width, colour] of [
    [3.5, "#000b"],
    [1.5, "#fff"],
  ] as const) {
    pen.lineWidth = width;
    pen.strokeStyle = colour;
    pen.beginPath();
    pen.moveTo(x, frame.top);
    pen.lineTo(x, y - 7);
    pen.moveTo(x, y + 7);
    pen.lineTo(x, frame.top + frame.height);
    pen.moveTo(frame.left, y);
    pen.lineTo(x - 7, y);
    pen.moveTo(x + 7, y);
    pen.lineTo(frame.left + frame.width, y);
    pen.moveTo(x + 7, y);
    pen.arc(x, y, 7, 0, 2 * Math.PI);
    pen.stroke();
  }
}

function circle(pen: CanvasRenderingContext2D, x: number, y: number, radius: number): void {
  pen.beginPath();
  pen.arc(x, y, radius, 0, 2 * Math.PI);
}

function axes(pen: CanvasRenderingContext2D, { frame, controls }: Drawing): void {
  pen.fillStyle = theme.colour("--soft");
  pen.font = "11px system-ui, sans-serif";
  const [across, along] = controls;
  const below = frame.top + frame.height + 14;
  pen.textAlign = "center";
  for (const value of [across.minimum, across.maximum])
    pen.fillText(figure(value), frame.x(value), below);
  pen.fillText(titled(across), frame.left + frame.width / 2, below + 14);
  pen.textAlign = "right";
  for (const value of [along.minimum, along.maximum])
    pen.fillText(figure(value), frame.left - 5, frame.y(value) + 4);
  pen.save();
  pen.translate(12, frame.top + frame.height / 2);
  pen.rotate(-Math.PI / 2);
  pen.textAlign = "center";
  pen.fillText(titled(along), 0, 0);
  pen.restore();
}

const titled = (control: Control): string => `${control.name} (${control.unit})`;
