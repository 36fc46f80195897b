/** Plan of the floor from above: the path of the root, points of walks, targets and obstacles. */

import { el, svg } from "../dom.ts";
import type { Performance } from "./performance.ts";
import { read, segmentOf } from "./script.ts";

type Point = readonly [x: number, z: number];
/** Space around what is drawn, and radii of a point and the body, m. */
const [MARGIN, DOT, BODY] = [0.6, 0.07, 0.14];

export function mount(host: HTMLElement, performance: Performance): void {
  const shapes = svg("g");
  const body = svg("path", { class: "plan-body" });
  const words = "Plan of the floor: path, points, targets and obstacles";
  const plan = svg("svg", { class: "plan", role: "img", "aria-label": words }, shapes, body);
  const about = "Squares are a metre wide. x is to the left, z up.";
  host.append(el("h3", {}, "Floor plan"), plan, el("p", { class: "about" }, about));
  performance.listen((change) => {
    if (change === "time" || change === "answer") place(body, performance);
    if (change !== "answer" || performance.busy) return;
    const { elements, points } = drawn(performance);
    const [xs, zs] = [points.map(([x]) => -x), points.map(([, z]) => -z)];
    const [left, top] = [Math.min(...xs) - MARGIN, Math.min(...zs) - MARGIN];
    const [right, bottom] = [Math.max(...xs) + MARGIN, Math.max(...zs) + MARGIN];
    plan.setAttribute("viewBox", `${left} ${top} ${right - left} ${bottom - top}`);
    shapes.replaceChildren(grid(left, top, right, bottom), ...elements);
  });
}

/** Turn the drawing of the body to where the root is at the time. */
function place(body: SVGElement, { motion, time }: Performance): void {
  if (!motion) return;
  const frame = Math.min(motion.times.length - 1, Math.round(time * motion.rate));
  const [x, , z] = motion.rootPosition.subarray(3 * frame, 3 * frame + 3);
  const at = 4 * motion.parents.length * frame;
  const [w, , y] = motion.rotations.subarray(at, at + 4);
  const turn = (-360 / Math.PI) * Math.atan2(y!, w!);
  const [side, front] = [0.6 * BODY, 1.6 * BODY];
  body.setAttribute("d", `M${-side} ${side}L0 ${-front}L${side} ${side}Z`);
  body.setAttribute("transform", `translate(${-x!} ${-z!}) rotate(${turn})`);
}

/** Draw the script and its motion; the plan shows x to the left and z up. */
function drawn({ motion, notes, refused, session }: Performance) {
  const elements: SVGElement[] = [];
  const points: Point[] = [[0, 0]];
  const script = read(session.store.state.script);
  const circle = ([x, z]: Point, r: number, kind: string) => {
    points.push([x - r, z - r], [x + r, z + r]);
    elements.push(svg("circle", { cx: -x, cy: -z, r, class: `plan-${kind}` }));
  };
  if (typeof script !== "string") {
    const { obstacles = [], segments, start } = script;
    for (const { position, radius } of list<{ position: unknown; radius: number }>(obstacles))
      if (isPoint(position) && radius > 0) circle(position, radius, "obstacle");
    segments.forEach((segment, index) => {
      const wrong = notes.some(({ fault, pointer }) => fault && segmentOf(pointer) === index);
      const kind = wrong ? "wrong" : "point";
      if (segment.kind === "walk")
        for (const point of [...list(segment.along), segment.to])
          if (isPoint(point)) circle(point, DOT, kind);
      if (segment.kind !== "act") return;
      for (const target of list<{ position?: readonly number[]; frame?: string }>(
        segment.targets,
      )) {
        const point = [target.position?.[0], target.position?.[2]];
        if (target.frame !== "segment" && isPoint(point)) circle(point, DOT, "target");
      }
    });
    const begin = start?.position;
    circle(isPoint(begin) ? begin : [0, 0], DOT, "start");
  }
  if (motion && !refused) {
    const { rate, rootPosition, times } = motion;
    for (const { begins, ends, kind } of motion.trust.segments) {
      const path: Point[] = [];
      const last = Math.min(times.length - 1, Math.ceil(ends * rate));
      for (let frame = Math.floor(begins * rate); frame <= last; frame++)
        path.push([rootPosition[3 * frame]!, rootPosition[3 * frame + 2]!]);
      points.push(...path);
      const text = path.map(([x, z]) => `${(-x).toFixed(3)},${(-z).toFixed(3)}`).join(" ");
      elements.unshift(svg("polyline", { points: text, class: "plan-path", "data-kind": kind }));
    }
  }
  return { elements, points };
}

/** A square for each metre. */
function grid(left: number, top: number, right: number, bottom: number): SVGElement {
  let lines = "";
  for (let x = Math.ceil(left); x <= right; x++) lines += `M${x} ${top}V${bottom}`;
  for (let z = Math.ceil(top); z <= bottom; z++) lines += `M${left} ${z}H${right}`;
  return svg("path", { d: lines, class: "plan-grid" });
}

/** Of a field that is written by hand; other values than lists are refused by the service. */
function list<Item>(value: unknown): readonly Item[] {
  return Array.isArray(value) ? value : [];
}

function isPoint(value: unknown): value is Point {
  return Array.isArray(value) && value.length === 2 && value.every(Number.isFinite);
}
