// Reads USD and glTF files with three.js: three_read.mjs MODULES FOLDER RESULT.json
//
// For each character of each file the result holds its joints and, for each key of its animation,
// their matrices in the world: 16 numbers by column, Y up, metres. Without an animation it has no
// frames. A file that cannot be read has no characters.
import { readdirSync, readFileSync, writeFileSync } from "node:fs";
import { join, resolve } from "node:path";
import { pathToFileURL } from "node:url";

const [modules, folder, result] = process.argv.slice(2);
const load = (path) => import(pathToFileURL(resolve(modules, "three", path)).href);
const { AnimationMixer } = await load("build/three.module.js");
const { USDLoader } = await load("examples/jsm/loaders/USDLoader.js");
const { GLTFLoader } = await load("examples/jsm/loaders/GLTFLoader.js");

function contents(path) {
  const data = readFileSync(path);
  return data.buffer.slice(data.byteOffset, data.byteOffset + data.byteLength);
}

function parsed(path) {
  try {
    return new USDLoader().parse(contents(path));
  } catch (fault) {
    return { animations: [], traverse() {} };
  }
}

// A glTF file has one character. What three.js cannot have in a name it takes out, and keeps the name.
async function readGltf(path) {
  const { scene, animations } = await new GLTFLoader().parseAsync(contents(path), "");
  const { joints, matrices } = motion(scene, animations);
  return { Character: { joints, matrices } };
}

function read(path) {
  if (path.endsWith(".glb")) return readGltf(path);
  const group = parsed(path);
  const roots = [];
  group.traverse((node) => node.userData.isSkelRoot && roots.push(node));
  return Object.fromEntries(roots.map((root) => [root.name, motion(root, group.animations)]));
}

// All characters of a crowd have joints of the same names: an animation is told whose it is by its
// own name, and looks for joints below that character alone.
function motion(root, animations) {
  const bones = [];
  root.traverse((node) => node.isBone && bones.push(node));
  const clip = animations.length > 1 ? animations.find(({ name }) => name === root.name) : animations[0];
  const joints = bones.map((bone) => bone.userData.name ?? bone.name);
  if (!clip) return { joints, matrices: [] };
  // An action repeats: without a longer clip its last key would be its first again.
  clip.duration += 1;
  const mixer = new AnimationMixer(root);
  mixer.clipAction(clip).play();
  const times = [...new Set(clip.tracks.flatMap((track) => [...track.times]))].sort((a, b) => a - b);
  return {
    joints,
    matrices: times.map((time) => pose(root, mixer, bones, time)),
  };
}

function pose(root, mixer, bones, time) {
  mixer.setTime(time);
  root.updateWorldMatrix(true, true);
  return bones.map((bone) => bone.matrixWorld.toArray());
}

const files = readdirSync(folder).filter((name) => /\.(usd.?|glb)$/.test(name)).sort();
const found = {};
for (const name of files) found[name] = await read(join(folder, name));
writeFileSync(result, JSON.stringify(found));
