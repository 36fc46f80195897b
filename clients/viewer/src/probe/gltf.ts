/** glTF: skins or animated nodes as joints, and the animations of them. */

import { rateOfKeys } from "./frame-rate.ts";
import { type Beside, type GltfAnimation, GltfDocument, item } from "./gltf-document.ts";
import { type GltfJoints, jointsOf } from "./gltf-joints.ts";
import {
  figured,
  type Motion,
  type Pose,
  pickedFrames,
  placed,
  Refusal,
  type Take,
} from "./motion.ts";
import { general } from "./numbers.ts";

const KINDS: Readonly<Record<string, readonly ["places" | "turns" | "scales", string, number]>> = {
  translation: ["places", "VEC3", 3],
  rotation: ["turns", "VEC4", 4],
  scale: ["scales", "VEC3", 3],
};
/** Keys that are less apart, s, are of one frame. */
const SAME_TIME = 1e-5;
const MOST_KEYS = 20_000_000;

interface Track {
  readonly joint: number;
  readonly part: "places" | "turns" | "scales";
  readonly width: number;
  readonly times: Float64Array;
  readonly values: Float64Array;
  readonly interpolation: string;
}

/** An animation as it is read; fault: why its keys are no frames. */
interface Read extends Take {
  readonly keys: Float64Array;
  readonly tracks: readonly Track[];
}

export async function readGltf(file: Blob, beside: Beside): Promise<Motion> {
  const document = await GltfDocument.open(file, beside);
  const animations = ofSkeletons(document);
  const animated = animations[0] ? nodesOf(animations[0]) : new Set<number>();
  const joints = jointsOf(document, animated);
  const takes: Read[] = [];
  for (const [index, own] of animations.entries())
    takes.push(await read(document, joints, own, own.name || `animation_${index}`));
  const { outer, rest } = joints;
  const parents = chained(joints);
  const first = takes[0];
  const keys = first?.keys ?? new Float64Array();
  const poses = pickedFrames(keys.length).map((frame) => posed(rest, first!.tracks, keys[frame]!));
  const all = figured(parents, poses);
  const own = (positions: Float64Array) => positions.subarray(3 * outer.length);
  const fps = first?.fps ?? null;
  const nodes = document.parts.nodes ?? [];
  return {
    format: "glTF",
    names: joints.names,
    parents: joints.parents,
    takes: takes.map(({ name, frames, fps, fault }) => ({ name, frames, fps, fault })),
    rateSaid: fps === null ? "" : `keys every ${general(1 / fps, 6)} s`,
    positions: all.positions.map(own),
    moves: all.moves.slice(outer.length),
    rest: own(placed(parents, rest)),
    metresPerUnit: 1,
    up: "y",
    meshes: {
      all: nodes.filter(({ mesh }) => mesh !== undefined).length,
      skinned: nodes.filter(({ mesh, skin }) => mesh !== undefined && skin !== undefined).length,
    },
    warnings: lacking(takes),
    notes: joints.notes,
  };
}

/** The nodes above the first joint stand before the joints, as joints of their own. */
function chained({ outer, parents }: GltfJoints): number[] {
  const above = outer.map((_, index) => index - 1);
  return [...above, ...parents.map((parent) => parent + outer.length)];
}

function lacking(takes: readonly Read[]): string[] {
  if (!takes.length) return ["found no animation, a skeleton or mesh without motion, expected one"];
  const faults = takes.flatMap(({ name, fault }) => (fault ? `animation '${name}': ${fault}` : []));
  if (takes.length === 1) return faults;
  const listed = takes
    .slice(0, 20)
    .map(({ name }) => `'${name}'`)
    .join(", ");
  return [
    `found ${takes.length} animations (${listed}), expected one: export each to a file of its own, or name one in the column clips.animation`,
    ...faults,
  ];
}

/** The animations that move joints, or several nodes where there are no skins; all if none does. */
function ofSkeletons(document: GltfDocument): readonly GltfAnimation[] {
  const { animations = [], skins = [] } = document.parts;
  const joints = new Set(skins.flatMap((skin) => skin.joints));
  const found = animations.filter((own) => {
    const moved = nodesOf(own);
    return joints.size ? [...moved].some((node) => joints.has(node)) : moved.size > 1;
  });
  return found.length ? found : animations;
}

function nodesOf(animation: GltfAnimation): Set<number> {
  return new Set(animation.channels.flatMap(({ target }) => target.node ?? []));
}

async function read(
  document: GltfDocument,
  joints: GltfJoints,
  animation: GltfAnimation,
  name: string,
): Promise<Read> {
  const order = [...joints.outer, ...joints.nodes];
  const tracks: Track[] = [];
  for (const { sampler, target } of animation.channels) {
    const kind = KINDS[target.path];
    const joint = order.indexOf(target.node ?? -1);
    if (kind && joint >= 0) {
      const own = item(animation.samplers, sampler, "sampler");
      tracks.push(await track(document, own, joint, kind));
    }
  }
  const keys = union(tracks);
  if (!keys.length)
    return {
      name,
      frames: 0,
      fps: null,
      fault: "moves no joint, expected one of the skeleton",
      keys,
      tracks,
    };
  try {
    const fps = rateOfKeys(keys);
    return { name, frames: keys.length, fps, fault: null, keys, tracks };
  } catch (fault) {
    if (!(fault instanceof Refusal)) throw fault;
    return { name, frames: keys.length, fps: null, fault: fault.message, keys, tracks };
  }
}

async function track(
  document: GltfDocument,
  { input, output, interpolation = "LINEAR" }: GltfAnimation["samplers"][number],
  joint: number,
  [part, kind, width]: (typeof KINDS)[string],
): Promise<Track> {
  const times = await document.numbers(input, "SCALAR");
  const all = await document.numbers(output, kind);
  const parts = interpolation === "CUBICSPLINE" ? 3 : 1;
  const rising = times.every((time, at) => at === 0 || time > times[at - 1]!);
  if (all.length !== parts * times.length * width || !rising)
    throw new Refusal(
      `found ${times.length} keys and ${all.length / width} values, expected ${parts} values for each of increasing times`,
    );
  // Of a cubic spline, the values between the tangents.
  const values = all.filter((_, at) => parts === 1 || Math.floor(at / width) % 3 === 1);
  return { joint, part, width, times, values, interpolation };
}

/** The times of all keys, those of one frame once. */
function union(tracks: readonly Track[]): Float64Array {
  const count = tracks.reduce((sum, { times }) => sum + times.length, 0);
  if (count > MOST_KEYS) throw new Refusal(`found ${count} keys, expected at most ${MOST_KEYS}`);
  const all = new Float64Array(count);
  let end = 0;
  for (const { times } of tracks) {
    all.set(times, end);
    end += times.length;
  }
  all.sort();
  return all.filter((time, at) => at === 0 || time - all[at - 1]! > SAME_TIME);
}

/** The joints at a time, straight between keys. */
function posed(rest: Required<Pose>, tracks: readonly Track[], time: number): Pose {
  const found = {
    places: rest.places.slice(),
    turns: rest.turns.slice(),
    scales: rest.scales.slice(),
  };
  for (const { joint, part, width, times, values, interpolation } of tracks) {
    let after = times.findIndex((each) => each > time + SAME_TIME);
    if (after < 0) after = times.length;
    const before = Math.max(after - 1, 0);
    const next = Math.min(after, times.length - 1);
    const gap = times[next]! - times[before]!;
    const far = gap > 0 ? Math.max(time - times[before]!, 0) / gap : 0;
    const share = interpolation === "STEP" ? 0 : Math.min(far, 1);
    const from = values.subarray(width * before, width * (before + 1));
    const to = values.subarray(width * next, width * (next + 1));
    const sign =
      part === "turns" && from.reduce((sum, each, at) => sum + each * to[at]!, 0) < 0 ? -1 : 1;
    const own = from.map((each, at) => each * (1 - share) + sign * to[at]! * share);
    const length = part === "turns" ? Math.hypot(...own) || 1 : 1;
    found[part].set(
      own.map((each) => each / length),
      width * joint,
    );
  }
  return found;
}
