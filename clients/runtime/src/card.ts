/** The model card in a file's metadata: what the run time needs of it. */

import type { ModelCard as ServiceCard } from "@posefield/client/types";
import { ModelError } from "./errors.ts";
import { metadata } from "./onnx-file.ts";
import type { Quaternion, Vector } from "./vectors.ts";

export interface Hinge {
  readonly joint: number;
  readonly reference: Quaternion;
  readonly axis: Vector;
  readonly bone: Vector;
  readonly low: Vector;
  readonly high: Vector;
}

type Texts = "name" | "description" | "roles" | "root";
type Lists = "controls" | "levels" | "labels" | "examples" | "feet" | "curves" | "contacts";
type Shared = Required<
  Pick<ServiceCard, Texts | Lists | "skeleton" | "cyclic" | "frames" | "event">
>;

/** As the service's, with limits of knees and elbows: metres, seconds, radians, Y up. */
export interface ModelCard extends Readonly<Shared> {
  readonly durations: readonly [number, number];
  readonly hinges: readonly Hinge[];
}

export type FootContact = ModelCard["contacts"][number];

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
