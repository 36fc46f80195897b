// Plays VRM animations on VRM avatars with three-vrm: vrma_read.mjs MODULES FOLDER RESULT.json
//
// For each NAME.vrma and NAME.vrm of the folder the result holds the places of the avatar's bones at
// rest, and for each key of the animation their places in the world, metres, by the bone's name.
import { readdirSync, readFileSync, writeFileSync } from "node:fs";
import { join, resolve } from "node:path";
import { pathToFileURL } from "node:url";

const [modules, folder, result] = process.argv.slice(2);
const load = (path) => import(pathToFileURL(resolve(modules, path)).href);
const { AnimationMixer, Vector3 } = await load("three/build/three.module.js");
const { GLTFLoader } = await load("three/examples/jsm/loaders/GLTFLoader.js");
const { VRMLoaderPlugin } = await load("@pixiv/three-vrm/lib/three-vrm.module.js");
const { VRMAnimationLoaderPlugin, createVRMAnimationClip } = await load(
  "@pixiv/three-vrm-animation/lib/three-vrm-animation.module.js",
);

async function parsed(name, Plugin) {
  const data = readFileSync(join(folder, name));
  const loader = new GLTFLoader();
  loader.register((parser) => new Plugin(parser));
  const { userData } = await loader.parseAsync(data.buffer.slice(data.byteOffset, data.byteOffset + data.byteLength), "");
  return userData;
}

function places(vrm, bones) {
  vrm.scene.updateWorldMatrix(true, true);
  return Object.fromEntries(
    bones.map((bone) => [bone, vrm.humanoid.getRawBoneNode(bone).getWorldPosition(new Vector3()).toArray()]),
  );
}

async function play(name) {
  const { vrm } = await parsed(`${name}.vrm`, VRMLoaderPlugin);
  const [animation] = (await parsed(`${name}.vrma`, VRMAnimationLoaderPlugin)).vrmAnimations;
  const bones = Object.keys(vrm.humanoid.humanBones);
  const rest = places(vrm, bones);
  const clip = createVRMAnimationClip(animation, vrm);
  const times = [...animation.humanoidTracks.rotation.get("hips").times];
  // An action repeats: without a longer clip its last key would be its first again.
  clip.duration += 1;
  const mixer = new AnimationMixer(vrm.scene);
  mixer.clipAction(clip).play();
  const frames = times.map((time) => {
    mixer.setTime(time);
    vrm.update(0);
    return places(vrm, bones);
  });
  const expressions = [...animation.expressionTracks.preset, ...animation.expressionTracks.custom].map(
    ([expression, track]) => [expression, [...track.values]],
  );
  return { rest, frames, expressions: Object.fromEntries(expressions) };
}

const names = readdirSync(folder).filter((name) => name.endsWith(".vrma"));
const read = {};
for (const file of names.sort()) read[file] = await play(file.slice(0, -".vrma".length));
writeFileSync(result, JSON.stringify(read));
