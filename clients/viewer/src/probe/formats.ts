/** Formats of motion files by suffix: those that are read here, and the way out for the others. */

import { suffixOf } from "./accepted.ts";
import { readBvh } from "./bvh.ts";
import { readGltf } from "./gltf.ts";
import type { Beside } from "./gltf-document.ts";
import { type Motion, Refusal } from "./motion.ts";
import { readUsd } from "./usd.ts";

interface Format {
  readonly read: (file: Blob, beside: Beside) => Promise<Motion>;
  /** Largest file, MB. */
  readonly most: number;
}

// BVH and glTF are read in pieces; USD is in memory as a whole, several times its size.
const BVH: Format = { read: readBvh, most: 300 };
const GLTF: Format = { read: readGltf, most: 1000 };
const USD: Format = { read: readUsd, most: 100 };
const READ: Readonly<Record<string, Format>> = {
  ".bvh": BVH,
  ".glb": GLTF,
  ".gltf": GLTF,
  ".usd": USD,
  ".usda": USD,
  ".usdc": USD,
  ".usdz": USD,
};

/** In the words of `posefield probe`. */
export const REFUSED: Readonly<Record<string, string>> = {
  ".fbx": "FBX is read through Blender: posefield convert FILE.fbx -o FILE.bvh",
  ".c3d": "C3D holds markers, not a skeleton: solve them in the capture software and export BVH",
  ".npy":
    "numpy arrays of features, such as those of HumanML3D, hold no joint rotations of a capture: use the BVH, AMC or SMPL source of the data set",
  ".npz":
    "SMPL parameters, such as those of AMASS, need a body model for the bones' lengths: export them with it as BVH or GLB",
  ".asf": "ASF holds a skeleton alone: name the .amc file, which is read with it",
  ".blend": "a Blender scene: export its armature as BVH or GLB",
  ".trc": "TRC holds markers, not a skeleton: solve them and export BVH",
  ".mvnx": "MVNX is not read: export BVH or FBX from the capture software",
};
/** Read by the command, not by the page. */
const BY_COMMAND: Readonly<Record<string, string>> = {
  ".amc":
    "AMC is read with the .asf file beside it, not on this page: posefield probe FILE.amc, or posefield convert FILE.amc -o FILE.bvh",
};

const MEGABYTE = 1_000_000;

/** The motion of a file by the suffix of its name; throws a Refusal with the way out. */
export async function readMotion(file: File, beside: Beside): Promise<Motion> {
  const suffix = suffixOf(file.name);
  const format = READ[suffix];
  if (!format) {
    const known = Object.keys(READ).join(", ");
    const none = `found the suffix '${suffix}', expected one of ${known}`;
    throw new Refusal(REFUSED[suffix] ?? BY_COMMAND[suffix] ?? none);
  }
  if (!file.size) throw new Refusal("found 0 bytes, expected a motion file");
  if (file.size > format.most * MEGABYTE)
    throw new Refusal(
      `found ${Math.round(file.size / MEGABYTE)} MB, expected at most ${format.most} MB on this page: posefield probe reads it`,
    );
  return format.read(file, beside);
}
