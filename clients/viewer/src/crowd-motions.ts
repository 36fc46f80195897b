/** Motions that a crowd shares, and its characters: positions, headings and levels, filled in place. */

import type { CrowdPoses, CrowdQuestion, ModelCard } from "@posefield/client";
import { Matrix4, type Vector3 } from "three";

import { standing } from "./character.ts";
import { choose, type Ladder, type Lens, pixels } from "./detail.ts";
import { labelsOf, otherSets, performerOf } from "./examples.ts";
import type { Session } from "./player.ts";
import { Joints } from "./skeleton.ts";

/** Number of motions, and frames of each, between which the graphics card interpolates. */
export const [MOTIONS, FRAMES] = [24, 24];
/** Number of motions that are takes: a service gives at most 2,000 characters with takes at once. */
export const TAKES = Math.floor(2000 / (FRAMES + 1));
/** Numbers of a joint's matrix: three rows of four. */
export const SIZE = 12;
/** Captured clips that are tried, and the fastest turn of a gentle walk, rad/s. */
const [TRIED, SHARPEST] = [120, 0.2];
/** Square metres to a character. */
const ROOM = 9;

/** Arc that a clip follows: s, m/s, rad to the left of the heading, and rad/s. */
interface Path {
  readonly seconds: number;
  readonly speed: number;
  readonly drift: number;
  readonly turning: number;
}

/** Motions with their poses at each level. */
export interface Motions {
  readonly levels: number;
  /** Characters walk; else they stay and repeat their clip forwards and backwards. */
  readonly walks: boolean;
  /** Of each motion. */
  readonly paths: readonly Path[];
  /** SIZE numbers for each level, motion, frame (FRAMES + 1) and joint: they move the skin. */
  readonly poses: Float32Array;
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

/** Fetch the motions of a model: their paths, then their poses; ten requests for four levels.
 *
 * progress: called with the share that is done. takes: make each motion a take.
 */
export async function fetchMotions(
  { card, service, signal, store }: Session,
  progress: (share: number) => void,
  takes: boolean,
): Promise<Motions> {
  const { model } = store.state;
  const requests = 2 + 2 * card.levels.length;
  let answered = 0;
  const ask: Ask = async (rows, rest) => {
    const question = { ...columns(card, rows), ...rest };
    const poses = await service.client.crowd(model, question, signal);
    answered += 1;
    progress(answered / requests);
    return poses;
  };
  const walks = card.cyclic && card.root === "travelling";
  const examples = card.examples.map((controls, i) => ({
    controls,
    performer: performerOf(card, i),
    labels: labelsOf(card, i),
  }));
  const tried = spread(examples, TRIED);
  const paths = await fetchPaths(tried, ask);
  const all = tried.map((_, i) => i);
  const gentle = all.filter((i) => Math.abs(paths[i]!.turning) <= SHARPEST);
  const fitting = spread(walks && gentle.length >= 6 ? gentle : all, MOTIONS);
  // Takes last and travel as the prediction does, so that several may share a captured clip.
  const chosen = takes
    ? Array.from({ length: TAKES }, (_, i) => fitting[i % fitting.length]!)
    : fitting;
  const rest = standing(card, Float32Array.from(card.skeleton.offsets.flat()));
  const size = chosen.length * (FRAMES + 1) * card.skeleton.names.length * SIZE;
  const poses = new Float32Array(card.levels.length * size);
  const rows = chosen.map((i) => tried[i]!);
  await Promise.all(
    card.levels.map(async (_, level) => {
      const { duration } = await ask(rows, { time: 0, level });
      const repeated = rows.flatMap((row) => Array<Row>(FRAMES + 1).fill(row));
      const motion = repeated.map((_, i) => Math.floor(i / (FRAMES + 1)));
      const time = motion.map((at, i) => (duration[at]! * (i % (FRAMES + 1))) / FRAMES);
      const root = walks ? "in_place" : "travelling";
      const take = takes ? { take: motion.map((at) => 1 + at) } : {};
      const answer = await ask(repeated, { time, level, root, ...take });
      writeMatrices(poses.subarray(level * size, (level + 1) * size), rest, answer, walks);
    }),
  );
  return { levels: card.levels.length, walks, paths: chosen.map((i) => paths[i]!), poses };
}

/** Return so many items of a list, evenly. */
function spread<Item>(all: readonly Item[], count: number): Item[] {
  const taken = Math.min(count, all.length);
  return Array.from({ length: taken }, (_, i) => all[Math.floor((i * all.length) / taken)]!);
}

function columns(
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

/** Fetch the arcs that clips follow, evenly (as service/posefield/locomotion/stride.py has them). */
async function fetchPaths(rows: readonly Row[], ask: Ask): Promise<Path[]> {
  const start = await ask(rows, { time: 0 });
  const end = await ask(rows, { time: [...start.duration] });
  const joints = start.names.length;
  return rows.map((_, i) => {
    const seconds = start.duration[i]!;
    const turn = turnBetween(start.rotations, end.rotations, 4 * joints * i);
    const [x, z] = [0, 2].map(
      (axis) => end.rootPosition[3 * i + axis]! - start.rootPosition[3 * i + axis]!,
    ) as [number, number];
    // The chord of an arc of the turn h is sin(h/2) / (h/2) of its length, and h/2 to the left.
    const chord = Math.abs(turn) < 1e-6 ? 1 : Math.sin(turn / 2) / (turn / 2);
    const speed = Math.hypot(x, z) / chord / seconds;
    return { seconds, speed, drift: Math.atan2(x, z) - turn / 2, turning: turn / seconds };
  });
}

/** Return the angle about +Y between two roots' rotations. */
function turnBetween(from: Float32Array, to: Float32Array, at: number): number {
  const [a, b, c, d] = from.subarray(at, at + 4) as unknown as Four;
  const [e, f, g, h] = to.subarray(at, at + 4) as unknown as Four;
  const angle = 2 * Math.atan2(-e * c - f * d + g * a + h * b, e * a + f * b + g * c + h * d);
  return angle - 2 * Math.PI * Math.round(angle / (2 * Math.PI));
}

/** Write the matrices of the joints of all poses, three rows of four; walks begin at the origin. */
function writeMatrices(
  out: Float32Array,
  rest: Float32Array,
  poses: CrowdPoses,
  walks: boolean,
): void {
  const joints = new Joints(poses.parents);
  const [matrix, back] = [new Matrix4(), new Matrix4()];
  const rootPosition = poses.rootPosition.slice();
  for (let row = 0; row < poses.levels.length; row++) {
    const first = 3 * (row - (row % (FRAMES + 1)));
    if (walks)
      for (const axis of [0, 2]) rootPosition[3 * row + axis]! -= poses.rootPosition[first + axis]!;
    joints.place({ ...poses, rootPosition }, row);
    for (const [joint, bone] of joints.bones.entries()) {
      const [x, y, z] = rest.subarray(3 * joint, 3 * joint + 3) as unknown as Four;
      matrix.multiplyMatrices(bone.matrixWorld, back.makeTranslation(-x, -y, -z)).transpose();
      out.set(matrix.elements.slice(0, SIZE), SIZE * (row * joints.bones.length + joint));
    }
  }
}

type Four = readonly [number, number, number, number];

interface Writable {
  [at: number]: number;
}

/** The characters of a crowd. */
export class Crowd {
  readonly count: number;
  /** Half of the field's side, m. */
  readonly half: number;
  readonly x: Float32Array;
  readonly z: Float32Array;
  /** Number of characters of each level. */
  readonly counts: Int32Array;
  readonly #level: Int8Array;
  readonly #heading: Float32Array;
  readonly #phase: Float32Array;
  readonly #motion: Uint16Array;
  readonly #motions: Motions;

  constructor(motions: Motions, count: number) {
    this.#motions = motions;
    this.count = count;
    this.half = half(count);
    [this.x, this.z] = [new Float32Array(count), new Float32Array(count)];
    [this.#heading, this.#phase] = [new Float32Array(count), new Float32Array(count)];
    this.#motion = new Uint16Array(count);
    this.#level = new Int8Array(count).fill(-1);
    this.counts = new Int32Array(motions.levels);
    // One in each cell of a grid, somewhere in it; the same every time.
    const random = uniform(1);
    const side = Math.ceil(Math.sqrt(count));
    const cell = (2 * this.half) / side;
    for (let i = 0; i < count; i++) {
      this.x[i] = (Math.floor(i / side) + 0.2 + 0.6 * random()) * cell - this.half;
      this.z[i] = ((i % side) + 0.2 + 0.6 * random()) * cell - this.half;
      this.#heading[i] = 2 * Math.PI * random();
      this.#phase[i] = random();
      this.#motion[i] = Math.floor(random() * motions.paths.length);
    }
  }

  /** Move all for some seconds; those who leave the field enter it at its other side. */
  step(seconds: number): void {
    const { paths, walks } = this.#motions;
    const [half, side] = [this.half, 2 * this.half];
    for (let i = 0; i < this.count; i++) {
      const path = paths[this.#motion[i]!]!;
      const phase = this.#phase[i]! + seconds / path.seconds;
      // Forwards and backwards takes two.
      this.#phase[i] = phase % (walks ? 1 : 2);
      if (!walks) continue;
      const heading = this.#heading[i]! + path.turning * seconds;
      const direction = heading + path.drift;
      const far = path.speed * seconds;
      this.#heading[i] = heading;
      const x = this.x[i]! + far * Math.sin(direction);
      const z = this.z[i]! + far * Math.cos(direction);
      this.x[i] = x > half ? x - side : x < -half ? x + side : x;
      this.z[i] = z > half ? z - side : z < -half ? z + side : z;
    }
  }

  /** Choose levels by their errors in pixels; a character around the camera is at the finest. */
  chooseLevels(ladder: Ladder, lens: Lens, camera: Vector3, limit: number): void {
    const wide = pixels(lens);
    const [mx, my, mz] = [ladder.middle[0]!, ladder.middle[1]!, ladder.middle[2]!];
    this.counts.fill(0);
    for (let i = 0; i < this.count; i++) {
      const [x, z] = [this.x[i]! + mx - camera.x, this.z[i]! + mz - camera.z];
      const y = my - camera.y;
      const far = Math.sqrt(x * x + y * y + z * z) - ladder.radius;
      const level = far > 0 ? choose(ladder.errors, wide / far, limit, this.#level[i]!) : 0;
      this.#level[i] = level;
      this.counts[level]!++;
    }
  }

  /** Write character `i`: x, z, heading and phase; its motion at its level, and the level. */
  write(standing: Writable, motion: Writable, at: number, i: number): void {
    const level = this.#level[i]!;
    const phase = this.#phase[i]!;
    standing[4 * at] = this.x[i]!;
    standing[4 * at + 1] = this.z[i]!;
    standing[4 * at + 2] = this.#heading[i]!;
    standing[4 * at + 3] = phase > 1 ? 2 - phase : phase;
    motion[2 * at] = level * this.#motions.paths.length + this.#motion[i]!;
    motion[2 * at + 1] = level;
  }
}

/** Return half of the side of the field of so many, m. */
export function half(count: number): number {
  return Math.sqrt(count * ROOM) / 2;
}

/** Return a generator of uniform numbers from 0 to 1 (mulberry32). */
function uniform(seed: number): () => number {
  let state = seed;
  return () => {
    state = (state + 0x6d2b79f5) | 0;
    let mixed = Math.imul(state ^ (state >>> 15), 1 | state);
    mixed = (mixed + Math.imul(mixed ^ (mixed >>> 7), 61 | mixed)) ^ mixed;
    return ((mixed ^ (mixed >>> 14)) >>> 0) / 2 ** 32;
  };
}
