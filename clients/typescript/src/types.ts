/** What is asked and answered, named as the contract names it. */

import type { components } from "./schema.ts";

type Schemas = components["schemas"];

export type ModelCard = Schemas["ModelCard"];
export type ModelSummary = Schemas["ModelSummary"];
export type Trust = Schemas["Trust"];
export type Reasons = Schemas["Reasons"];
export type SigmaGrid = Schemas["SigmaGrid"];

/** A question as one may write it: what has a default may be left out. */
export type PoseQuestion = Asked<Schemas["PoseQuestion"], "controls" | "times">;
export type ClipQuestion = Asked<Schemas["ClipQuestion"], "controls">;
export type CrowdQuestion = Asked<Schemas["CrowdQuestion"], "controls" | "time">;
export type SigmaQuestion = Asked<Schemas["SigmaQuestion"], "across" | "along">;
export type WhyQuestion = Asked<Schemas["WhyQuestion"], "controls">;

type Asked<Question, Needed extends keyof Question> = Pick<Question, Needed> & Partial<Question>;

export type ClipFormat =
  | "usda"
  | "usdc"
  | "usdz"
  | "glb"
  | "bvh"
  | "json"
  | "npz"
  | "arrow"
  | "msgpack";

/** Poses of the joints that the model's card names, at S times: metres, seconds, Y up. */
export interface Poses {
  readonly trust: Trust;
  readonly times: Float64Array;
  /** S × J × 4, unit quaternions w x y z local to the parent. */
  readonly rotations: Float32Array;
  /** S × 3, m. */
  readonly rootPosition: Float32Array;
  /** J × 3, m from the parent; the root's is not used. */
  readonly boneOffsets: Float32Array;
}

/** A clip as numbers, with the skeleton that it moves. */
export interface Motion extends Poses {
  readonly names: readonly string[];
  readonly parents: readonly number[];
  readonly rate: number;
  readonly frames: number;
}

/** A pose of each of N characters, roots in the world. */
export interface CrowdPoses {
  readonly model: string;
  readonly names: readonly string[];
  readonly parents: readonly number[];
  readonly warnings: readonly string[];
  /** N × J × 4. */
  readonly rotations: Float32Array;
  /** N × 3. */
  readonly rootPosition: Float32Array;
  /** N × J × 3. */
  readonly boneOffsets: Float32Array;
  readonly duration: Float32Array;
  readonly sigma: Float32Array;
  readonly levels: Int32Array;
  /** N, where a camera was given. */
  readonly errorPx: Float32Array | null;
}
