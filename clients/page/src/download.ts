/** A clip as binary glTF, with the skin of its model. */

import type { ModelCard } from "@posefield/client";
import type { Clip } from "@posefield/runtime";
import { animationClip, skeletonOf } from "@posefield/runtime/three";
import { type BufferAttribute, MeshStandardMaterial, SkinnedMesh } from "three";
import { GLTFExporter } from "three/addons/exporters/GLTFExporter.js";
import * as characters from "../../viewer/src/character.ts";

/** The bytes of a file with one skinned mesh and one animation. */
export async function glb(
  card: ModelCard,
  clip: Clip,
  character: characters.Character,
): Promise<ArrayBuffer> {
  const rest = Float32Array.from(card.skeleton.offsets.flat());
  const offsets = clip.boneOffsets.slice();
  offsets.set(rest.subarray(0, 3));
  const rig = skeletonOf({ ...clip, boneOffsets: offsets });
  const geometry = characters.geometry(character, character.fine);
  const points = geometry.getAttribute("position") as BufferAttribute;
  const standing = characters.standing(card, rest);
  characters.fitted(
    points.array as Float32Array,
    character,
    standing,
    characters.standing(card, offsets),
  );
  const mesh = new SkinnedMesh(geometry, new MeshStandardMaterial({ color: 0xcfb698 }));
  mesh.add(rig.root);
  mesh.bind(rig.skeleton);
  const animations = [animationClip(clip, card.name)];
  const content = await new GLTFExporter().parseAsync(mesh, { binary: true, animations });
  return content as ArrayBuffer;
}
