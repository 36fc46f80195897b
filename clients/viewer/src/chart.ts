/** Drawing of a map: sigma as colours, hatching without support, captured clips, and the controls. */

import type { SigmaGrid } from "@posefield/client";

import type { Control, Dot } from "./examples.ts";
import * as theme from "./theme.ts";
import { figure } from "./written.ts";

/** Margin of the map beyond the sampled ranges, as a share of them. */
export const MARGIN = 0.25;
const [LEFT, RIGHT, TOP, BOTTOM] = [46, 10, 10, 34];
const [DOT, RING] = [2.5, 7];

/** Conversion between values of two controls and points of a canvas, in CSS pixels. */
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

  /** Return the values at a point, within the map. */
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
  const unrounded =
    control.minimum + size * (Math.min(1, Math.max(0, place)) * (1 + 2 * MARGIN) - MARGIN);
  return rounded(unrounded, size);
}

/** To a thousandth of the range, so that numbers stay short. */
export function rounded(value: number, range: number): number {
  const step = 10 ** Math.floor(Math.log10(range / 1000));
  return Number((Math.round(value / step) * step).toPrecision(10));
}

/** Tell for each row and column whether similar clips were captured. */
export function captured(grid: SigmaGrid): readonly (readonly boolean[])[] {
  return grid.supported ?? grid.inside;
}

/** Return the least and greatest sigma, m, of the part with support; beyond, colours are the last one. */
export function extent(grid: SigmaGrid): [number, number] {
  const all = grid.sigma.flat();
  const supported = captured(grid).flat();
  const near = all.filter((_, i) => supported[i]);
  const values = near.length ? near : all;
  return [Math.min(...values), Math.max(...values)];
}

/** Return a picture of one pixel a value, which the canvas stretches smoothly. */
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
  /** The part without support. */
  readonly veil: Veil | null;
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
  if (it.veil) hatch(pen, frame, it.veil);
  for (const dot of it.dots) mark(pen, frame, dot, dot.index === it.chosen);
  cross(pen, frame, it.point);
  pen.restore();
  axes(pen, it);
}

/** Draw the picture; values are in the middle of their pixels, so its border lies outside the map. */
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

/** The part without support, in columns and rows of a grid, and the size of the grid. */
export interface Veil {
  readonly area: Path2D;
  readonly columns: number;
  readonly rows: number;
}

/** Overlap of the squares around points of the grid, so that no seam shows. */
const OVERLAP = 0.05;

export function veil(grid: SigmaGrid): Veil {
  const supported = captured(grid);
  const area = new Path2D();
  for (const [row, cells] of supported.entries())
    for (const [column, inside] of cells.entries())
      if (!inside) area.rect(column - 0.5, row - 0.5, 1 + OVERLAP, 1 + OVERLAP);
  return { area, columns: supported[0]!.length, rows: supported.length };
}

/** Pixels from one stripe to the next. */
const APART = 7;

/** Hatch the part without support, and dash the sampled ranges. */
function hatch(pen: CanvasRenderingContext2D, frame: Frame, veil: Veil): void {
  pen.save();
  const [right, up] = [frame.width / (veil.columns - 1), frame.height / (veil.rows - 1)];
  const onMap = new Path2D();
  // Rows go up, and down on a canvas.
  onMap.addPath(veil.area, new DOMMatrix([right, 0, 0, -up, frame.left, frame.top + frame.height]));
  pen.clip(onMap);
  pen.fillStyle = theme.colour("--veil");
  pen.fillRect(frame.left, frame.top, frame.width, frame.height);
  pen.strokeStyle = theme.colour("--stripe");
  pen.lineWidth = 1;
  pen.beginPath();
  for (let x = frame.left - frame.height; x < frame.left + frame.width; x += APART) {
    pen.moveTo(x, frame.top + frame.height);
    pen.lineTo(x + frame.height, frame.top);
  }
  pen.stroke();
  pen.restore();
  pen.strokeStyle = "#fffc";
  pen.lineWidth = 1;
  pen.setLineDash([4, 3]);
  pen.strokeRect(...frame.range);
  pen.setLineDash([]);
}

// Viridis (van der Walt and Smith, 2015): even steps look even, to the colour-blind too.
const VIRIDIS = [
  0x440154, 0x482878, 0x3e4a89, 0x31688e, 0x26828e, 0x1f9e89, 0x35b779, 0x6ece58, 0xb5de2b,
  0xfde725,
] as const;

/** Write red, green and blue, 0 to 255, at a share of the scale into `out`. */
export function viridis(share: number, out: Uint8ClampedArray | number[], at = 0): void {
  const position = Math.min(1, Math.max(0, share)) * (VIRIDIS.length - 1);
  const first = Math.min(VIRIDIS.length - 2, Math.floor(position));
  const [low, high] = [VIRIDIS[first]!, VIRIDIS[first + 1]!];
  for (let i = 0; i < 3; i++) {
    const shift = 16 - 8 * i;
    const [a, b] = [(low >> shift) & 255, (high >> shift) & 255];
    out[at + i] = a + (b - a) * (position - first);
  }
}
