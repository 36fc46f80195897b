/** A model file that is computed here: poses, clips and walkers. */

import type { ModelCard } from "./card.ts";
import { readCard } from "./card.ts";
import { type Clip, type ClipOptions, clip } from "./clip.ts";
import { InvalidField, ModelError } from "./errors.ts";
import { findLegs } from "./limbs.ts";
import { type Onnxruntime, type Point, Session } from "./session.ts";
import { clamp } from "./vectors.ts";
import { Walkers } from "./walker.ts";

/** Values of all controls, such as `model.defaults` with some changed. */
export type Controls = Readonly<Record<string, number>>;

export interface Options {
  /** Name of the performer; an unseen one by default. */
  readonly performer?: string | undefined;
  /** Name by label set; sets that are not given are left open. */
  readonly labels?: Readonly<Record<string, string>>;
  /** Level of detail; 0 is the finest. */
  readonly level?: number;
}

export interface LoadOptions {
  /** A build of onnxruntime-web; by default that for WebAssembly. */
  readonly ort?: Onnxruntime;
  /** Execution providers of onnxruntime, such as "webgpu", in order; by default "wasm". */
  readonly providers?: readonly string[];
}

/** Poses of one performer: metres, seconds; quaternions w x y z, local to the parent. */
export interface Poses {
  readonly names: readonly string[];
  readonly parents: readonly number[];
  readonly times: Float64Array;
  /** Of each pose and joint. */
  readonly rotations: Float32Array;
  readonly rootPosition: Float32Array;
  readonly boneOffsets: Float32Array;
  /** Of each pose and curve; empty without curves. */
  readonly curves: Float32Array;
  /** Of the whole motion, s. */
  readonly duration: number;
  /** Expected error at the controls, m. */
  readonly sigma: number;
}

const POSE_OUTPUTS = ["rotations", "root_position", "bone_offsets", "duration", "sigma"] as const;
/** Options of poses, walkers and clips. */
const OPTIONS = ["performer", "labels", "level", "fps", "loop", "root", "feet"];
const MOST_POSES = 10_000;
/** Share by which a duration from another machine may differ. */
const TIME_SLACK = 1e-5;

/** The model of a file at a URL, or of its bytes. */
export async function load(
  source: string | URL | Uint8Array,
  options: LoadOptions = {},
): Promise<Model> {
  const content = source instanceof Uint8Array ? source : await download(source);
  const ort: Onnxruntime = options.ort ?? (await import("onnxruntime-web/wasm"));
  // A pose takes less time than a message to another thread.
  ort.env.wasm.numThreads = 1;
  return new Model(new Session(content, readCard(content), ort, options.providers ?? ["wasm"]));
}

async function download(url: string | URL): Promise<Uint8Array> {
  const answer = await fetch(url);
  if (!answer.ok) throw new ModelError(`${url}: status ${answer.status}, expected a model file`);
  return new Uint8Array(await answer.arrayBuffer());
}

export class Model {
  readonly session: Session;

  constructor(session: Session) {
    this.session = session;
  }

  get card(): ModelCard {
    return this.session.card;
  }

  /** Controls of the captured clip in the middle. */
  get defaults(): Record<string, number> {
    return Object.fromEntries(this.card.controls.map((control) => [control.name, control.default]));
  }

  /** True where feet can stand: the model travels, and knows contacts of feet and their knees. */
  get stands(): boolean {
    return this.card.root === "travelling" && findLegs(this.card).length > 0;
  }

  /** True for a cycle with a measured speed, which walkers need. */
  get walks(): boolean {
    const { controls, cyclic } = this.card;
    return this.stands && cyclic && controls.some(({ measure }) => measure?.quantity === "speed");
  }

  /** Poses at a time or at several, s from the start of the clip. */
  async pose(
    controls: Controls,
    time: number | readonly number[],
    options: Options = {},
  ): Promise<Poses> {
    const point = this.point(controls, options);
    const times = typeof time === "number" ? [time] : time;
    if (times.length < 1 || times.length > MOST_POSES)
      throw new InvalidField("times", `${times.length} times, expected 1 to ${MOST_POSES}`);
    for (const [index, value] of times.entries()) finite(`times/${index}`, value);
    const { skeleton, curves } = this.card;
    const names = curves.length ? ([...POSE_OUTPUTS, "curves"] as const) : POSE_OUTPUTS;
    // Times far beyond the longest clip overflow single precision; they are refused below.
    const longest = 10 * this.card.durations[1]!;
    const within = times.map((value) => clamp(value, 0, longest));
    const outputs = await this.session.run(point, within, ...names);
    const duration = outputs.duration[0]!;
    for (const [index, value] of times.entries())
      range(`times/${index}`, value, 0, duration * (1 + TIME_SLACK), "s");
    return {
      names: skeleton.names,
      parents: skeleton.parents,
      times: Float64Array.from(times),
      rotations: outputs.rotations,
      rootPosition: outputs.root_position,
      boneOffsets: outputs.bone_offsets,
      curves: outputs.curves ?? new Float32Array(),
      duration,
      sigma: outputs.sigma[0]!,
    };
  }

  /** A clip; its feet stand where they can. */
  clip(controls: Controls, options: ClipOptions = {}): Promise<Clip> {
    return clip(this, controls, options);
  }

  /** Walkers that are steered, of a walk. */
  walkers(count: number, options: Options = {}): Promise<Walkers> {
    return Walkers.of(this, count, options);
  }

  /** The inputs of the graph for a question; InvalidField for one that cannot be answered. */
  point(controls: Controls, options: Options = {}): Point {
    const { card } = this;
    const names = card.controls.map(({ name }) => `controls/${name}`);
    refuseUnknown(
      Object.keys(controls).map((name) => `controls/${name}`),
      names,
    );
    refuseUnknown(Object.keys(options), OPTIONS);
    const row = card.controls.map(({ name, minimum, maximum, unit }) =>
      range(`controls/${name}`, controls[name], minimum, maximum, unit),
    );
    const level = options.level ?? 0;
    if (!Number.isInteger(level) || level < 0 || level >= card.levels.length)
      throw new InvalidField("level", `${level}, expected 0 to ${card.levels.length - 1}`);
    return { controls: [row], labels: labelWeights(card, options), level };
  }
}

function refuseUnknown(fields: readonly string[], known: readonly string[]): void {
  const unknown = fields.find((field) => !known.includes(field));
  if (unknown !== undefined)
    throw new InvalidField(unknown, `unknown, expected ${known.join(", ")}`);
}

/** A finite number; InvalidField for any other value. */
export function finite(field: string, value: unknown): number {
  if (typeof value === "number" && Number.isFinite(value)) return value;
  throw new InvalidField(field, `${value}, expected a finite number`);
}

/** A number within limits; InvalidField for any other value. */
export function range(
  field: string,
  value: unknown,
  low: number,
  high: number,
  unit: string,
): number {
  const number = finite(field, value);
  if (number >= low && number <= high) return number;
  throw new InvalidField(field, `${number} ${unit}, expected ${low} to ${high} ${unit}`);
}

/** Weights of the names of all label sets; those of a set that is left open are zero. */
function labelWeights({ labels }: ModelCard, { performer, labels: sets = {} }: Options): number[] {
  if (performer !== undefined && sets["performer"] !== undefined)
    throw new InvalidField("performer", `${performer} and labels/performer, expected one`);
  const values = performer === undefined ? sets : { ...sets, performer };
  for (const [set, value] of Object.entries(values)) {
    const names = labels.find(({ name }) => name === set)?.names ?? [];
    if (!names.includes(value))
      throw new InvalidField(`labels/${set}`, `${value}, expected ${names.join(", ") || "none"}`);
  }
  return labels.flatMap((set) => set.names.map((name) => Number(values[set.name] === name)));
}
