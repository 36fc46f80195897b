/** What the readers of motion files find, in the file's own unit and axes. */

/** What is wrong with a file: what was found and what was expected. */
export class Refusal extends Error {}

/** One animation of a file; fault: why its keys are no frames. */
export interface Take {
  readonly name: string;
  readonly frames: number;
  readonly fps: number | null;
  readonly fault: string | null;
}

/**
 * positions: of the joints, x y z each, in some of the frames. rest: of the figure at rest. moves:
 * whether a joint changes its place in its parent.
 */
export interface Motion {
  readonly format: "BVH" | "glTF" | "USD";
  readonly names: readonly string[];
  readonly parents: readonly number[];
  readonly takes: readonly Take[];
  /** How the rate is known. */
  readonly rateSaid: string;
  readonly positions: readonly Float64Array[];
  readonly moves: readonly boolean[];
  readonly rest: Float64Array;
  /** As the file states them; null if it does not. */
  readonly metresPerUnit: number | null;
  readonly up: "y" | "z" | null;
  /** Meshes, and how many of them hang on the skeleton; null where the format has none. */
  readonly meshes: { readonly all: number; readonly skinned: number } | null;
  /** What lacks or keeps the file from being trained on. */
  readonly warnings: readonly string[];
  /** What the reader assumed, or did not look at. */
  readonly notes: readonly string[];
}

/** Places and turns of joints in their parents: x y z, and x y z w. */
export interface Pose {
  readonly places: Float64Array;
  readonly turns: Float64Array;
  readonly scales?: Float64Array;
}

/** Frames that are measured, spread evenly. */
const MOST_FRAMES = 200;
export const MOST_JOINTS = 1000;

export function pickedFrames(count: number): number[] {
  const most = Math.min(count, MOST_FRAMES);
  const at = (index: number) => Math.round((index * (count - 1)) / Math.max(most - 1, 1));
  return [...new Set(Array.from({ length: most }, (_, index) => at(index)))];
}

/** What poses in some of the frames tell. */
export function figured(
  parents: readonly number[],
  poses: readonly Pose[],
): Pick<Motion, "positions" | "moves"> {
  const first = poses[0]?.places;
  const differs = ({ places }: Pose, joint: number) =>
    [0, 1, 2].some((axis) => places[3 * joint + axis] !== first?.[3 * joint + axis]);
  return {
    positions: poses.map((pose) => placed(parents, pose)),
    moves: parents.map((_, joint) => poses.some((pose) => differs(pose, joint))),
  };
}

/** Places of all joints in the world, parents first. */
export function placed(parents: readonly number[], pose: Pose): Float64Array {
  const { places, turns } = pose;
  const found = new Float64Array(places.length);
  const world = new Float64Array(turns.length);
  const sizes = new Float64Array(places.length).fill(1);
  parents.forEach((parent, joint) => {
    const own = [...places.subarray(3 * joint, 3 * joint + 3)] as Vector;
    const turn = [...turns.subarray(4 * joint, 4 * joint + 4)] as Turn;
    const above = (
      parent < 0 ? [0, 0, 0, 1] : [...world.subarray(4 * parent, 4 * parent + 4)]
    ) as Turn;
    if (parent >= 0) for (let axis = 0; axis < 3; axis++) own[axis]! *= sizes[3 * parent + axis]!;
    const moved = rotated(above, own);
    for (let axis = 0; axis < 3; axis++) {
      found[3 * joint + axis] = moved[axis]! + (parent < 0 ? 0 : found[3 * parent + axis]!);
      sizes[3 * joint + axis] =
        (pose.scales?.[3 * joint + axis] ?? 1) * (parent < 0 ? 1 : sizes[3 * parent + axis]!);
    }
    world.set(product(above, turn), 4 * joint);
  });
  return found;
}

export type Vector = [number, number, number];
export type Turn = [number, number, number, number];

export function product([ax, ay, az, aw]: Turn, [bx, by, bz, bw]: Turn): Turn {
  return [
    aw * bx + ax * bw + ay * bz - az * by,
    aw * by - ax * bz + ay * bw + az * bx,
    aw * bz + ax * by - ay * bx + az * bw,
    aw * bw - ax * bx - ay * by - az * bz,
  ];
}

function rotated([x, y, z, w]: Turn, [a, b, c]: Vector): Vector {
  const [tx, ty, tz] = [2 * (y * c - z * b), 2 * (z * a - x * c), 2 * (x * b - y * a)];
  return [a + w * tx + y * tz - z * ty, b + w * ty + z * tx - x * tz, c + w * tz + x * ty - y * tx];
}
