/** What lies under stripes on a map, and the frame of what was sampled. */

import type { Frame } from "./chart.ts";
import * as theme from "./theme.ts";
import type { Veil } from "./veil.ts";

/** Pixels from one stripe to the next. */
const APART = 7;

/** Where nothing like it was captured, with an outline. */
export function unsupported(pen: CanvasRenderingContext2D, frame: Frame, veil: Veil): void {
  striped(pen, frame, placed(veil.area, frame, veil), "nonzero");
  const edge = placed(veil.edge, frame, veil);
  pen.lineCap = "round";
  for (const [width, colour] of [
    [3.5, "#000a"],
    [1.5, "#fff"],
  ] as const) {
    pen.lineWidth = width;
    pen.strokeStyle = colour;
    pen.stroke(edge);
  }
  border(pen, frame, [4, 3]);
}

/** All that was never sampled; inside: whether the controls that are no axes were. */
export function unsampled(pen: CanvasRenderingContext2D, frame: Frame, inside: boolean): void {
  const part = new Path2D();
  part.rect(frame.left, frame.top, frame.width, frame.height);
  if (inside) part.rect(...frame.range);
  striped(pen, frame, part, "evenodd");
  border(pen, frame, []);
}

function striped(
  pen: CanvasRenderingContext2D,
  frame: Frame,
  part: Path2D,
  rule: CanvasFillRule,
): void {
  pen.save();
  pen.clip(part, rule);
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
}

/** Around what was sampled. */
function border(pen: CanvasRenderingContext2D, frame: Frame, dashes: number[]): void {
  pen.strokeStyle = "#fffc";
  pen.lineWidth = 1;
  pen.setLineDash(dashes);
  pen.strokeRect(...frame.range);
  pen.setLineDash([]);
}

/** From columns and rows to a canvas, on which rows go down. */
function placed(path: Path2D, frame: Frame, { columns, rows }: Veil): Path2D {
  const [right, up] = [frame.width / (columns - 1), frame.height / (rows - 1)];
  const found = new Path2D();
  found.addPath(path, new DOMMatrix([right, 0, 0, -up, frame.left, frame.top + frame.height]));
  return found;
}
