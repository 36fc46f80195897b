/** The model card in a file's metadata: what the run time needs of it. */

import { ModelError } from "./errors.ts";
import { metadata } from "./onnx-file.ts";

export type Triple = readonly [number, number, number];

export interface Control {
  readonly name: string;
  readonly unit: string;
  readonly description: string;
  readonly minimum: number;
  readonly maximum: number;
  readonly default: number;
  /** Quantity of the motion by which the control is measured. */
  readonly measure?: { readonly quantity: string };
}

export interface LabelSet {
  readonly name: string;
  readonly names: readonly string[];
}

export interface FootContact {
  readonly joint: number;
  readonly height: number;
  readonly swing: number;
  readonly longest_swing: number;
  readonly clearance: number;
}

export interface Hinge {
  readonly joint: number;
  readonly reference: readonly [number, number, number, number];
  readonly axis: Triple;
  readonly bone: Triple;
  readonly low: Triple;
  readonly high: Triple;
}

/** Metres, seconds, radians, Y up. */
export interface ModelCard {
  readonly name: string;
  readonly description: string;
  readonly controls: readonly Control[];
  readonly skeleton: {
    readonly names: readonly string[];
    readonly parents: readonly number[];
    readonly offsets: readonly Triple[];
    readonly tip_joints: readonly number[];
    readonly tip_offsets: readonly Triple[];
  };
  readonly cyclic: boolean;
  readonly root: "travelling" | "in_place";
  readonly frames: number;
  readonly levels: readonly { readonly joints: readonly number[]; readonly pose: number }[];
  readonly durations: readonly [number, number];
  readonly labels: readonly LabelSet[];
  readonly examples: readonly (readonly number[])[];
  readonly feet: readonly number[];
  readonly roles: Readonly<Record<string, string>>;
  readonly event: { readonly joint: number; readonly share: number } | null;
  readonly curves: readonly { readonly name: string }[];
  readonly contacts: readonly FootContact[];
  readonly hinges: readonly Hinge[];
}

/** Version of the metadata that this run time reads. */
const FORMAT = 5;
const PREFIX = "posefield.";
const NEEDED = ["controls", "skeleton", "levels", "durations", "labels", "feet", "cyclic", "root"];

/** The card of a model file; ModelError for another file, or one of another version. */
export function readCard(content: Uint8Array): ModelCard {
  const entries: Record<string, unknown> = { curves: [], contacts: [], hinges: [], event: null };
  for (const [key, value] of metadata(content)) {
    if (!key.startsWith(PREFIX)) continue;
    try {
      entries[key.slice(PREFIX.length)] = JSON.parse(value);
    } catch (fault) {
      throw new ModelError(`its metadata ${key} is no JSON`, { cause: fault });
    }
  }
  if (entries["format"] !== FORMAT)
    throw new ModelError(`format ${entries["format"]}, expected a posefield model of ${FORMAT}`);
  const missing = NEEDED.filter((name) => entries[name] === undefined);
  if (missing.length) throw new ModelError(`its card has no ${missing.join(", ")}`);
  return entries as unknown as ModelCard;
}
