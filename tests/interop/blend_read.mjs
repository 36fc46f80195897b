// Blends a baked walk with three.js by the program of the guide: blend_read.mjs MODULES FOLDER RESULT.json
//
// FOLDER has the blend space, `walker.mjs`, and `points.json`: by the name of a clip of the model the
// point where it is blended. The result has by name the largest distance of bones below the root from
// the clip, m, over a cycle, and the mean and largest speed of the hips over three, m/s.
import { readFileSync, writeFileSync } from "node:fs";
import { join, resolve } from "node:path";
import { pathToFileURL } from "node:url";

const [modules, folder, result] = process.argv.slice(2);
const load = (path) => import(pathToFileURL(resolve(path)).href);
const { AnimationMixer, Vector3 } = await load(join(modules, "three/build/three.module.js"));
const { GLTFLoader } = await load(join(modules, "three/examples/jsm/loaders/GLTFLoader.js"));
const { BlendedWalk } = await load(join(folder, "walker.mjs"));

const STEPS = 60;
const json = (name) => JSON.parse(readFileSync(join(folder, name)));
const parsed = (name) => new GLTFLoader().parseAsync(new Uint8Array(readFileSync(join(folder, name))).buffer, "");

function places(object) {
  object.updateWorldMatrix(true, true);
  const bones = [];
  object.traverse((each) => each.isBone && bones.push(each));
  return bones.map((bone) => bones[0].worldToLocal(bone.getWorldPosition(new Vector3())));
}

const space = json("blendspace.json");
const found = {};
for (const [name, point] of Object.entries(json("points.json"))) {
  const walk = new BlendedWalk(space, await Promise.all(space.samples.map(({ file }) => parsed(file))));
  const { scene, animations } = await parsed(`${name}.glb`);
  const mixer = new AnimationMixer(scene);
  mixer.clipAction(animations[0]).play();
  const duration = walk.weights(point).reduce((sum, weight, i) => sum + weight * space.samples[i].duration, 0);
  const hips = [];
  let distance = 0;
  for (let step = 0; step < 3 * STEPS; step++) {
    walk.step(step ? duration / STEPS : 0, point);
    const blended = places(walk.object);
    hips.push(walk.object.getObjectByName("Hips").getWorldPosition(new Vector3()));
    mixer.setTime(((step % STEPS) / STEPS) * animations[0].duration);
    places(scene).forEach((place, i) => (distance = Math.max(distance, place.distanceTo(blended[i]))));
  }
  const speeds = hips.slice(1).map((place, i) => (place.distanceTo(hips[i]) * STEPS) / duration);
  const speed = speeds.reduce((sum, each) => sum + each, 0) / speeds.length;
  found[name] = { distance, speed, fastest: Math.max(...speeds) };
}
writeFileSync(result, JSON.stringify(found));
