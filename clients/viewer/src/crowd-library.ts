/** The motions that a crowd shares: few are asked for, each at every level, and laid out once. */

import type { CrowdPoses, CrowdQuestion, ModelCard } from "@posefield/client";

import { standing } from "./character.ts";
import { SIZE } from "./crowd-mesh.ts";
import { labelsOf, mover, otherSets } from "./examples.ts";
import type { Source } from "./page.ts";
import { type Placed, place, placed } from "./skeleton.ts";

/** Motions, and frames of each: what lies between two frames is mixed from them. */
export const [MOTIONS, FRAMES] = [24, 24];
/** Motions of a crowd of takes: a service gives at most 2,000 characters of a question a take. */
export const TAKES = Math.floor(2000 / (FRAMES + 1));
/** Captured clips that are tried, and the fastest turn, rad/s, of who walks a gentle way. */
const [TRIED, SHARPEST] = [120, 0.2];

/** What the characters of a crowd do: how long a clip lasts, and where it leads. */
export interface Motions {
  readonly levels: number;
  readonly count: number;
  /** Whether characters go somewhere; else they stay and repeat their clip there and back. */
  readonly walks: boolean;
  /** For each motion: seconds, metres a second, rad to the left of the heading, rad a second. */
  readonly seconds: Float32Array;
  readonly speeds: Float32Array;
  readonly drifts: Float32Array;
  readonly turning: Float32Array;
  /** x and z of the root at the beginning of each motion, m. */
  readonly starts: Float32Array;
}

/** Motions whose poses lie ready. */
export interface Library extends Motions {
  /** SIZE numbers for each level, motion, frame (FRAMES + 1) and joint: what moves the skin. */
  readonly poses: Float32Array;
}

/** Motions as the graphics card computes them: controls, and weights of all labels, of each. */
export interface ComputedMotions extends Motions {
  readonly points: Float32Array<ArrayBuffer>;
}

interface Row {
  readonly controls: readonly number[];
  readonly performer: string | null;
  readonly labels: Readonly<Record<string, string>>;
}

type Ask = (
  rows: readonly Row[],
  rest: Partial<CrowdQuestion> & Pick<CrowdQuestion, "time">,
) => Promise<CrowdPoses>;

/** Asks for poses of rows, and counts the answers among so many. */
function asker(
  source: Source,
  model: string,
  card: ModelCard,
  signal: AbortSignal,
  progress: (share: number) => void,
  questions: number,
): Ask {
  let answered = 0;
  return async (rows, rest) => {
    const poses = await source.crowd(model, { ...asked(card, rows), ...rest }, signal);
    answered += 1;
    progress(answered / questions);
    return poses;
  };
}

function walking(card: ModelCard): boolean {
  return card.cyclic && card.root === "travelling";
}

/** Which of the rows a crowd may do: those of a walk that turn gently, if there are enough. */
function fitting(tried: readonly Row[], ways: Ways, walks: boolean): number[] {
  const all = tried.map((_, i) => i);
  const gentle = all.filter((i) => Math.abs(ways.turning[i]!) <= SHARPEST);
  return walks && gentle.length >= 6 ? gentle : all;
}

/** Two questions: all motions that fit, whose poses the graphics card computes. */
export async function computedMotions(
  source: Source,
  model: string,
  card: ModelCard,
  signal: AbortSignal,
  progress: (share: number) => void,
): Promise<ComputedMotions> {
  const [tried, walks] = [rows(card), walking(card)];
  const ways = await journeys(tried, asker(source, model, card, signal, progress, 2));
  const chosen = fitting(tried, ways, walks);
  const points = Float32Array.from(chosen.flatMap((i) => point(card, tried[i]!)));
  return { ...motions(card, ways, chosen, walks), points };
}

function motions(card: ModelCard, ways: Ways, chosen: readonly number[], walks: boolean): Motions {
  const pick = (all: Float32Array) => Float32Array.from(chosen, (i) => all[i]!);
  const starts = chosen.flatMap((i) => [ways.starts[2 * i]!, ways.starts[2 * i + 1]!]);
  return {
    levels: card.levels.length,
    count: chosen.length,
    walks,
    seconds: pick(ways.seconds),
    speeds: pick(ways.speeds),
    drifts: pick(ways.drifts),
    turning: pick(ways.turning),
    starts: Float32Array.from(starts),
  };
}

/** Controls in the order of the card, and a weight for each name of each label set. */
function point({ labels = [] }: ModelCard, row: Row): number[] {
  const weights = labels.flatMap(({ name, names }) => {
    const own = name === "performer" ? row.performer : row.labels[name];
    return names.map((each) => (each === own ? 1 : 0));
  });
  return [...row.controls, ...weights];
}

/**
 * Ten questions for a model of four levels: what its clips do, and then their poses.
 *
 * progress: called with the share that is done. takes: whether each motion is a take of its own.
 */
export async function library(
  source: Source,
  model: string,
  card: ModelCard,
  signal: AbortSignal,
  progress: (share: number) => void,
  takes = false,
): Promise<Library> {
  const ask = asker(source, model, card, signal, progress, 2 + 2 * card.levels.length);
  const [tried, walks] = [rows(card), walking(card)];
  const ways = await journeys(tried, ask);
  const some = spread(fitting(tried, ways, walks), MOTIONS);
  // Takes last and travel as the prediction does, so that several may share a captured clip.
  const chosen = takes ? Array.from({ length: TAKES }, (_, i) => some[i % some.length]!) : some;
  const rest = standing(card, Float32Array.from(card.skeleton.offsets.flat()));
  const size = chosen.length * (FRAMES + 1) * card.skeleton.names.length * SIZE;
  const all = new Float32Array(card.levels.length * size);
  const own = chosen.map((i) => tried[i]!);
  await Promise.all(
    card.levels.map(async (_, level) => {
      const { duration } = await ask(own, { time: 0, level });
      const repeated = own.flatMap((row) => Array<Row>(FRAMES + 1).fill(row));
      const time = repeated.map(
        (_, i) => (duration[Math.floor(i / (FRAMES + 1))]! * (i % (FRAMES + 1))) / FRAMES,
      );
      const root = walks ? "in_place" : "travelling";
      const take = repeated.map((_, i) => 1 + Math.floor(i / (FRAMES + 1)));
      const poses = await ask(repeated, { time, level, root, ...(takes && { take }) });
      lay(all.subarray(level * size, (level + 1) * size), rest, poses, walks);
    }),
  );
  return { ...motions(card, ways, chosen, walks), poses: all };
}

function rows(card: ModelCard): Row[] {
  const all = card.examples.map((controls, i) => ({
    controls,
    performer: mover(card, i),
    labels: labelsOf(card, i),
  }));
  return spread(all, TRIED);
}

/** So many of a list, evenly. */
function spread<Item>(all: readonly Item[], count: number): Item[] {
  const taken = Math.min(count, all.length);
  return Array.from({ length: taken }, (_, i) => all[Math.floor((i * all.length) / taken)]!);
}

function asked(
  card: ModelCard,
  rows: readonly Row[],
): Pick<CrowdQuestion, "controls"> & Partial<CrowdQuestion> {
  const controls = Object.fromEntries(
    card.controls.map(({ name }, i) => [name, rows.map((row) => row.controls[i]!)]),
  );
  const performer = card.performers.length ? rows.map((row) => row.performer) : null;
  const labels = Object.fromEntries(
    otherSets(card).map(({ name }) => [name, rows.map((row) => row.labels[name]!)]),
  );
  return { controls, performer, labels };
}

type Ways = Pick<Motions, "seconds" | "speeds" | "drifts" | "turning" | "starts">;

/** How far clips lead: an arc, gone evenly (service/posefield/locomotion/stride.py says the same). */
async function journeys(rows: readonly Row[], ask: Ask): Promise<Ways> {
  const start = await ask(rows, { time: 0 });
  const end = await ask(rows, { time: [...start.duration] });
  const joints = start.names.length;
  const found = rows.map((_, i) => {
    const turn = turned(start.rotations, end.rotations, 4 * joints * i);
    const gap = [0, 2].map(
      (axis) => end.rootPosition[3 * i + axis]! - start.rootPosition[3 * i + axis]!,
    );
    const [x, z] = [gap[0]!, gap[1]!];
    // An arc of a turn h leads as far as its way times sin(h/2) / (h/2), and h/2 to the left.
    const bent = Math.abs(turn) < 1e-6 ? 1 : Math.sin(turn / 2) / (turn / 2);
    return {
      turn,
      speed: Math.hypot(x, z) / bent / start.duration[i]!,
      drift: Math.atan2(x, z) - turn / 2,
    };
  });
  return {
    seconds: start.duration,
    speeds: Float32Array.from(found, ({ speed }) => speed),
    drifts: Float32Array.from(found, ({ drift }) => drift),
    turning: Float32Array.from(found, ({ turn }, i) => turn / start.duration[i]!),
    starts: Float32Array.from(
      rows.flatMap((_, i) => [start.rootPosition[3 * i]!, start.rootPosition[3 * i + 2]!]),
    ),
  };
}

/** Angle about +Y between two roots' rotations. */
function turned(from: Float32Array, to: Float32Array, at: number): number {
  const [a, b, c, d] = [from[at]!, from[at + 1]!, from[at + 2]!, from[at + 3]!];
  const [e, f, g, h] = [to[at]!, to[at + 1]!, to[at + 2]!, to[at + 3]!];
  const w = e * a + f * b + g * c + h * d;
  const y = -e * c - f * d + g * a + h * b;
  const angle = 2 * Math.atan2(y, w);
  return angle - 2 * Math.PI * Math.round(angle / (2 * Math.PI));
}

/** Joints' matrices of all poses; a walker's way begins at the origin. */
function lay(out: Float32Array, rest: Float32Array, poses: CrowdPoses, walks: boolean): void {
  const joints = poses.names.length;
  const frame = placed(joints);
  const [turns, shifts] = [4 * joints, 3 * joints];
  for (let row = 0; row < poses.levels.length; row++) {
    const first = 3 * (row - (row % (FRAMES + 1)));
    const root = poses.rootPosition.slice(3 * row, 3 * row + 3);
    if (walks) {
      root[0]! -= poses.rootPosition[first]!;
      root[2]! -= poses.rootPosition[first + 2]!;
    }
    const offsets = poses.boneOffsets.subarray(shifts * row, shifts * (row + 1));
    const rotations = poses.rotations.subarray(turns * row, turns * (row + 1));
    place(frame, poses.parents, offsets, rotations, root, 0);
    for (let joint = 0; joint < joints; joint++) {
      matrix(out, SIZE * (row * joints + joint), rest, frame, joint);
    }
  }
}

/** What takes a point of the skin at rest to where a joint has it: three rows of four numbers. */
function matrix(
  out: Float32Array,
  at: number,
  rest: Float32Array,
  { positions, rotations }: Placed,
  joint: number,
): void {
  const [w, x, y, z] = rotations.subarray(4 * joint, 4 * joint + 4) as unknown as Four;
  const [a, b, c] = rest.subarray(3 * joint, 3 * joint + 3) as unknown as Four;
  const rows = [
    [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
    [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
    [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
  ] as const;
  rows.forEach(([i, j, k], row) => {
    const shift = positions[3 * joint + row]! - i * a - j * b - k * c;
    out.set([i, j, k, shift], at + 4 * row);
  });
}

type Four = readonly [number, number, number, number];
