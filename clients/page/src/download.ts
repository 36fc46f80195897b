/** A clip as binary glTF, with the skin of its model. */

import type { ModelCard } from "@posefield/client";
import type { Clip } from "@posefield/runtime";
import { animationClip, nodeNames } from "@posefield/runtime/three";
import { MeshStandardMaterial } from "three";
import { GLTFExporter } from "three/addons/exporters/GLTFExporter.js";
import type { Character } from "../../viewer/src/character.ts";
import { SkinnedBody } from "../../viewer/src/figure.ts";

/** The bytes of a file with one skinned mesh and one animation. */
export async function glb(card: ModelCard, clip: Clip, skin: Character): Promise<ArrayBuffer> {
  const body = new SkinnedBody(card, skin, [new MeshStandardMaterial({ color: 0xcfb698 })]);
  const names = nodeNames(clip.names);
  for (const [joint, bone] of body.skeleton.bones.entries()) bone.name = names[joint]!;
  const rotations = Float32Array.from(names.flatMap(() => [1, 0, 0, 0]));
  const root = Float32Array.from(card.skeleton.offsets[0]!);
  body.show({ rotations, root, offsets: clip.boneOffsets });
  // The exporter finds animated nodes below one object, and the validator wants its skin at the top.
  const [hips, mesh] = body.children;
  const animations = [animationClip(clip, card.name)];
  const options = { binary: true, animations };
  return (await new GLTFExporter().parseAsync(mesh!.add(hips!), options)) as ArrayBuffer;
}
