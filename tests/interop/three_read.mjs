// Reads USD files with three.js: three_read.mjs MODULES FOLDER RESULT.json
//
// For each file the result holds its joints and, for each key of its animation, their matrices in
// the world: 16 numbers by column, Y up, metres. A file without an animation has no frames.
import { readdirSync, readFileSync, writeFileSync } from "node:fs";
import { join, resolve } from "node:path";
import { pathToFileURL } from "node:url";

const [modules, folder, result] = process.argv.slice(2);
const load = (path) => import(pathToFileURL(resolve(modules, "three", path)).href);
const { AnimationMixer } = await load("build/three.module.js");
const { USDLoader } = await load("examples/jsm/loaders/USDLoader.js");

function contents(path) {
  const data = readFileSync(path);
  return data.buffer.slice(data.byteOffset, data.byteOffset + data.byteLength);
}

function read(path) {
  const group = new USDLoader().parse(contents(path));
  const bones = [];
  group.traverse((node) => node.isBone && bones.push(node));
  const [clip] = group.animations;
  if (!clip) return { joints: bones.map((bone) => bone.name), matrices: [] };
  // An action repeats: without a longer clip its last key would be its first again.
  clip.duration += 1;
  const mixer = new AnimationMixer(group);
  mixer.clipAction(clip).play();
  const times = [...new Set(clip.tracks.flatMap((track) => [...track.times]))].sort((a, b) => a - b);
  return {
    joints: bones.map((bone) => bone.name),
    matrices: times.map((time) => pose(group, mixer, bones, time)),
  };
}

function pose(group, mixer, bones, time) {
  mixer.setTime(time);
  group.updateMatrixWorld(true);
  return bones.map((bone) => bone.matrixWorld.toArray());
}

const files = readdirSync(folder).filter((name) => /\.usd.$/.test(name)).sort();
const found = Object.fromEntries(files.map((name) => [name, read(join(folder, name))]));
writeFileSync(result, JSON.stringify(found));
