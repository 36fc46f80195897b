/** Questions and answers, named as in the contract. */

import type { components, operations } from "./schema.ts";

type Schemas = components["schemas"];

export type ManifestEntry = Schemas["ManifestEntry"];
/** A constraint of a motion, and the distance by which it is missed. */
export type Met = Schemas["Met"];
export type ModelCard = Schemas["ModelCard"];
export type CharacterList = Schemas["CharacterList"];
export type ModelSummary = Schemas["ModelSummary"];
/** Timeline, joins and warnings of a performance. */
export type PerformanceReport = Schemas["PerformanceReport"];
/** One performance of an archive, with its report. */
export type PerformanceEntry = Schemas["PerformanceEntry"];
export type Readiness = Schemas["Readiness"];
export type Reasons = Schemas["Reasons"];
export type Suggestions = Schemas["Suggestions"];
export type SigmaGrid = Schemas["SigmaGrid"];
/** A joint that is to be in its place, at a `time` or `at` a moment of the motion. */
export type Target = Schemas["Target"];
export type Floor = Schemas["Floor"];
export type Trust = Schemas["Trust"];

/** A question as one may write it: what has a default may be left out. */
export type PoseQuestion = Asked<Schemas["PoseQuestion"], "controls" | "times">;
export type ClipQuestion = Asked<Schemas["ClipQuestion"], "controls">;
export type NamedClipQuestion = Asked<Schemas["NamedClipQuestion"], "controls">;
export type CrowdQuestion = Asked<Schemas["CrowdQuestion"], "controls" | "time">;
export type SigmaQuestion = Asked<Schemas["SigmaQuestion"], "across" | "along">;
export type WhyQuestion = Asked<Schemas["WhyQuestion"], "controls">;

/** A segment of a script as one may write it. */
export type WalkSegment = Part<"Walk", "kind" | "model">;
export type ActSegment = Omit<Part<"Act", "kind" | "model">, "targets"> & {
  readonly targets?: readonly Part<"PlacedTarget", "joint" | "position">[];
};
export type HoldSegment = Part<"Hold", "kind" | "seconds">;
export type Segment = WalkSegment | ActSegment | HoldSegment;

/** A script as one may write it, and how it is written to a file. */
export type PerformanceQuestion = Omit<
  Part<"PerformanceQuestion", never>,
  "segments" | "character" | "start"
> & {
  readonly segments: readonly Segment[];
  readonly character?: Part<"CharacterChoice", "model"> | null;
  readonly start?: Partial<Schemas["PerformanceStart"]>;
};

/** A script with the name of its file. */
export type NamedScript = PerformanceQuestion & { readonly name?: string | null };

type Part<Name extends keyof Schemas, Needed extends keyof Schemas[Name]> = Omit<
  Asked<Schemas[Name], Needed>,
  "join"
> & { readonly join?: Partial<Schemas["Join"]> };

/** Characters that walk; the camera as three numbers, m, and labels of all of them by label set. */
export type WalkQuestion = Omit<Walk, "camera" | "label"> & {
  readonly labels?: Schemas["Labels"];
  readonly camera?: readonly [x: number, y: number, z: number];
};

type Walk = NonNullable<operations["getCrowdInFormat"]["parameters"]["query"]>;
type Asked<Question, Needed extends keyof Question> = Pick<Question, Needed> & Partial<Question>;

export type ClipFormat = Schemas["ClipsQuestion"]["format"];
export type ClipEnding = Format<"getClipInFormat">;
export type CrowdFormat = Format<"getCrowdInFormat">;

/** Archives of many clips. */
export type ArchiveFormat = Format<"queryClipsInFormat">;

type Format<Id extends "getClipInFormat" | "getCrowdInFormat" | "queryClipsInFormat"> =
  operations[Id]["parameters"]["path"]["format"];

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
  /** S × C, the card's curves; null for a model without curves. */
  readonly curves: Float32Array | null;
}

/** A clip as numbers, with the skeleton that it moves. */
export interface Motion extends Poses {
  readonly names: readonly string[];
  readonly parents: readonly number[];
  /** C; empty for a model without curves. */
  readonly curveNames: readonly string[];
  readonly rate: number;
  readonly frames: number;
  /** Units of the numbers: other lengths and another axis up, where the question asked for them. */
  readonly units: Readonly<Record<string, string>>;
}

/** A performance as numbers, with a report in place of a clip's. */
export interface PerformanceMotion extends Omit<Motion, "trust"> {
  readonly trust: PerformanceReport;
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
  /** N, whether anything like it was captured; from services that say so. */
  readonly supported: readonly boolean[] | null;
  readonly levels: Int32Array;
  /** N, where a camera was given. */
  readonly errorPx: Float32Array | null;
  /** Names of the curves; empty for models without them. */
  readonly curveNames: readonly string[];
  /** N × C, for models with curves. */
  readonly curves: Float32Array | null;
}

/** Facts about a file from the head of its answer. */
export interface Named {
  /** As the service names it. */
  readonly name: string;
  readonly mediaType: string;
  /** The model that answered, as name@hash. */
  readonly model: string | null;
  /** As in Trust, m; of a single clip. */
  readonly sigma: number | null;
  /** As in Trust, s; of a single clip. */
  readonly duration: number | null;
  /** As in Trust; of a single clip. */
  readonly supported: boolean | null;
  /** Values that the service chose, by the controls that were left out; of a single clip. */
  readonly inferred: Readonly<Record<string, number>>;
  /** Targets that the clip misses; of a single clip. */
  readonly missed: readonly Missed[];
  readonly warnings: readonly string[];
}

/** Distance by which a clip misses a constraint. */
export type Missed = Pick<Met, "what" | "miss" | "unit">;

/** A file, whole. */
export interface Download extends Named {
  readonly content: Uint8Array<ArrayBuffer>;
}

/** Bytes that have come, and how many there will be where the service has said so. */
export interface Progress {
  readonly received: number;
  readonly total: number | null;
}

export type OnProgress = (progress: Progress) => void;

/** Options of a large file beside its question. */
export interface TransferOptions {
  readonly signal?: AbortSignal | undefined;
  readonly onProgress?: OnProgress | undefined;
}

/** Animations in USD files: of the whole performance, or besides it of each segment. */
export interface PerformanceFileOptions extends TransferOptions {
  readonly layout?: Schemas["PerformanceLayout"] | undefined;
  /** Character of a user that moves, one of `/v1/characters`; that of the script without it. */
  readonly character?: Schemas["CharacterName"] | undefined;
}

/** Options of an archive; `as` is its format, zip by default. */
export interface ArchiveOptions extends TransferOptions {
  readonly as?: ArchiveFormat;
}

/** Options of an archive of performances. */
export interface PerformanceArchiveOptions extends PerformanceFileOptions {
  readonly as?: ArchiveFormat;
}
