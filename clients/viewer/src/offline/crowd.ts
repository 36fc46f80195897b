/** One pose of each of many characters, by the model in the browser. */

import type { CrowdPoses, CrowdQuestion, ModelCard } from "@posefield/client";

import { choose, ladder, pixels } from "../detail.ts";
import * as door from "./door.ts";
import type { Answers, Graph, Rows } from "./graph.ts";
import { turned, turnRoot } from "./plane.ts";
import type { Support } from "./support.ts";

/** Levels differ in how long a clip takes; so does float32. */
const SLACK = 0.1;

/** Headings are taken within a turn, where float32 still tells small angles apart. */
const TURN = 2 * Math.PI;

interface Block {
  readonly rotations: Float32Array;
  readonly roots: Float32Array;
  readonly offsets: Float32Array;
  readonly duration: Float32Array;
  readonly sigma: Float32Array;
  readonly travel: Float32Array;
}

export async function crowd(
  graph: Graph,
  card: ModelCard,
  support: Support,
  asked: CrowdQuestion,
): Promise<CrowdPoses> {
  const count = size(asked);
  for (const name of ["from_level", "blend", "budget_ms"] as const) {
    if ((asked[name] ?? null) !== null) throw new door.NeedsService(`a crowd with ${name}`);
  }
  const rows = questions(card, asked, count);
  const { levels, errorPx } = detail(card, asked, count);
  const block = await answers(graph, card, rows, levels);
  check(card, rows, block, levels);
  if (asked.root === "in_place") stay(block, count);
  place(block, asked, count);
  return {
    model: card.identity,
    names: card.skeleton.names,
    parents: card.skeleton.parents,
    warnings: [],
    rotations: block.rotations,
    rootPosition: block.roots,
    boneOffsets: block.offsets,
    duration: block.duration,
    sigma: block.sigma,
    supported: supported(support, rows),
    levels,
    errorPx,
  };
}

function supported(support: Support, { count, controls }: Rows): boolean[] {
  const width = controls.length / count;
  return Array.from({ length: count }, (_, row) =>
    support.holds(controls.subarray(row * width, (row + 1) * width)),
  );
}

function size(asked: CrowdQuestion): number {
  const { time, position, heading, level, performer } = asked;
  const named = [performer, ...Object.values(asked.labels ?? {})];
  const columns = [...Object.values(asked.controls), time, position, heading, level, ...named];
  const sizes = columns.filter(Array.isArray).map((column) => column.length);
  const [first = 1] = sizes;
  if (sizes.some((each) => each !== first))
    throw new door.Refused("crowd: lists of one length expected");
  return first;
}

function questions(card: ModelCard, asked: CrowdQuestion, count: number): Rows {
  const labels: number[] = [];
  const columns = card.controls.map(({ name }) => column(asked.controls[name], count));
  const controls = new Float32Array(count * columns.length);
  for (let row = 0; row < count; row++) {
    card.controls.forEach((control, i) => {
      controls[row * columns.length + i] = door.value(control, columns[i]![row]);
    });
    labels.push(...door.weights(card, own(asked, row)));
  }
  const times = Float32Array.from(column(asked.time, count));
  return { count, controls, times, labels: Float32Array.from(labels) };
}

/** The labels of one character. */
function own({ performer, labels = {} }: CrowdQuestion, row: number): door.Named {
  const of = (given: unknown): unknown => (Array.isArray(given) ? given[row] : given);
  const named = Object.entries(labels).map(([name, given]) => [name, of(given)]);
  return { performer: of(performer ?? null), labels: Object.fromEntries(named) } as door.Named;
}

/** A number for everybody, or one for each. */
function column(given: number | number[] | undefined, count: number): number[] {
  return Array.isArray(given) ? given : Array<number>(count).fill(given ?? Number.NaN);
}

function detail(
  card: ModelCard,
  asked: CrowdQuestion,
  count: number,
): { levels: Int32Array; errorPx: Float32Array | null } {
  if (asked.level !== "auto") {
    const given = column((asked.level ?? 0) as number | number[], count);
    return { levels: Int32Array.from(given, (level) => door.level(card, level)), errorPx: null };
  }
  if (!asked.camera) throw new door.Refused('camera: missing; level "auto" needs one');
  const { errors, middle, radius } = ladder(card);
  const { position, ...lens } = asked.camera;
  const [levels, errorPx] = [new Int32Array(count), new Float32Array(count)];
  for (let i = 0; i < count; i++) {
    const own = asked.position?.[i] ?? [0, 0, 0];
    const far = Math.hypot(...own.map((at, axis) => at + middle[axis]! - position[axis]!)) - radius;
    if (far <= 0) throw new door.Refused(`camera: inside character ${i}`);
    const scale = pixels(lens) / far;
    levels[i] = choose(errors, scale, asked.pixels ?? 1, asked.previous_level?.[i] ?? -1);
    errorPx[i] = errors[levels[i]!]! * scale;
  }
  return { levels, errorPx };
}

async function answers(
  graph: Graph,
  card: ModelCard,
  rows: Rows,
  levels: Int32Array,
): Promise<Block> {
  const [joints, { count }] = [card.skeleton.parents.length, rows];
  const block: Block = {
    rotations: new Float32Array(4 * joints * count),
    roots: new Float32Array(3 * count),
    offsets: new Float32Array(3 * joints * count),
    duration: new Float32Array(count),
    sigma: new Float32Array(count),
    travel: new Float32Array(3 * count),
  };
  for (const level of new Set(levels)) {
    const which = [...levels.keys()].filter((row) => levels[row] === level);
    const found = await graph.run(picked(rows, which), level);
    which.forEach((row, i) => {
      copy(block, row, found, i, joints);
    });
  }
  return block;
}

function picked({ controls, times, labels, count }: Rows, which: readonly number[]): Rows {
  const part = (all: Float32Array) => {
    const width = all.length / count;
    const own = new Float32Array(which.length * width);
    which.forEach((row, i) => {
      own.set(all.subarray(row * width, (row + 1) * width), i * width);
    });
    return own;
  };
  return {
    count: which.length,
    controls: part(controls),
    times: part(times),
    labels: part(labels),
  };
}

function copy(block: Block, row: number, found: Answers, i: number, joints: number): void {
  const move = (to: Float32Array, from: Float32Array, size: number) =>
    to.set(from.subarray(i * size, (i + 1) * size), row * size);
  move(block.rotations, found.rotations, 4 * joints);
  move(block.roots, found.root_position, 3);
  move(block.offsets, found.bone_offsets, 3 * joints);
  move(block.duration, found.duration, 1);
  move(block.sigma, found.sigma, 1);
  move(block.travel, found.travel, 3);
}

function check(card: ModelCard, rows: Rows, block: Block, levels: Int32Array): void {
  rows.times.forEach((time, row) => {
    const duration = door.sensible(card, block.duration[row]!);
    door.within("time", time, 0, duration * (1 + (levels[row] ? SLACK : 1e-5)));
  });
}

/** Takes out of the poses how far each cycle has got. */
function stay({ rotations, roots, travel }: Block, count: number): void {
  for (let row = 0; row < count; row++) {
    roots[3 * row]! -= travel[3 * row]!;
    roots[3 * row + 2]! -= travel[3 * row + 1]!;
    turnRoot(rotations, (rotations.length / count) * row, -travel[3 * row + 2]!);
  }
}

/** Puts the poses where the characters stand. */
function place({ rotations, roots }: Block, asked: CrowdQuestion, count: number): void {
  const headings = column(asked.heading ?? 0, count);
  for (let row = 0; row < count; row++) {
    const angle = headings[row]! - TURN * Math.floor(headings[row]! / TURN);
    turnRoot(rotations, (rotations.length / count) * row, angle);
    const at = asked.position?.[row] ?? [0, 0, 0];
    const { x, z } = turned({ x: roots[3 * row]!, z: roots[3 * row + 2]! }, angle);
    roots[3 * row] = x + at[0]!;
    roots[3 * row + 1]! += at[1]!;
    roots[3 * row + 2] = z + at[2]!;
  }
}
