/** USD: skeleton and animations of UsdSkel in one layer, by the parsers of three.js. */

import { USDAParser } from "three/addons/loaders/usd/USDAParser.js";
import { USDCParser } from "three/addons/loaders/usd/USDCParser.js";

import { rateOfKeys } from "./frame-rate.ts";
import {
  figured,
  MOST_JOINTS,
  type Motion,
  type Pose,
  pickedFrames,
  Refusal,
  type Take,
} from "./motion.ts";
import { general } from "./numbers.ts";
import { Layer, type Specs } from "./usd-layer.ts";
import { checkUsdc } from "./usdc-check.ts";
import { firstEntry } from "./zip.ts";

const SHOWN = 20;

/** Where the skeleton has its joints. */
interface Tree {
  readonly paths: readonly string[];
  readonly names: readonly string[];
  readonly parents: readonly number[];
}

export async function readUsd(file: Blob): Promise<Motion> {
  const layer = new Layer(await specsOf(file));
  const skeletons = layer.prims("Skeleton");
  const animations = layer.prims("SkelAnimation");
  const lack = lacking(layer, skeletons, animations);
  const prim = boundTo(layer, skeletons, animations) ?? skeletons[0];
  const tree = prim === undefined ? NO_TREE : treeOf(layer, prim);
  const pace = layer.pace;
  const takes = animations.map((path) => takeOf(layer, path, pace));
  const fps = takes[0]?.fps ?? null;
  const first = animations[0];
  const rest = prim === undefined ? new Float64Array() : restOf(layer, prim, tree);
  const poses = first === undefined || !tree.names.length ? [] : posesOf(layer, first, prim!, tree);
  const moved = prim === undefined ? [] : layer.transformsAbove(prim);
  const meshes = layer.prims("Mesh");
  return {
    format: "USD",
    names: tree.names,
    parents: tree.parents,
    takes,
    rateSaid: fps === null ? "" : `keys every ${general(1 / fps, 6)} s`,
    ...figured(tree.parents, poses),
    rest,
    metresPerUnit: layer.number("metersPerUnit"),
    up: layer.up,
    meshes: {
      all: meshes.length,
      skinned: meshes.filter((path) => layer.isBound(path)).length,
    },
    warnings: [
      ...lack,
      ...takes.flatMap(({ name, fault }) => (fault ? [`${name}: ${fault}`] : [])),
    ],
    notes: [
      ...(layer.statesPace ? [] : [`states no timeCodesPerSecond, ${pace} is USD's default`]),
      ...(moved.length
        ? [`transforms above the skeleton (${moved[0]}) are not looked at here`]
        : []),
      ...(layer.references.length ? [REFERS(layer.references)] : []),
    ],
  };
}

const NO_TREE: Tree = { paths: [], names: [], parents: [] };
const REFERS = (paths: readonly string[]) =>
  `${paths.slice(0, 3).join(", ")} refers to other files or has variants, which this page does not follow: posefield probe does`;

async function specsOf(file: Blob): Promise<Specs> {
  let content: Blob = file;
  const start = await mark(file);
  if (start.startsWith("PK")) {
    const entry = await firstEntry(file);
    if (!/\.usd[ac]?$/i.test(entry.name))
      throw new Refusal(`found ${entry.name} first in the package, expected a USD layer`);
    content = entry.content;
  }
  const magic = start.startsWith("PK") ? await mark(content) : start;
  try {
    if (magic === "PXR-USDC") {
      const bytes = await content.arrayBuffer();
      checkUsdc(bytes);
      return new USDCParser().parseData(bytes).specsByPath;
    }
    if (magic.startsWith("#usda")) {
      const text = await content.text();
      refuseUnclosed(text);
      return new USDAParser().parseData(text).specsByPath;
    }
  } catch (fault) {
    if (fault instanceof Refusal) throw fault;
    throw new Refusal(
      `does not open as USD: ${(fault as Error).message}. The file is damaged or not whole`,
    );
  }
  throw new Refusal(`does not open as USD: begins with '${magic}', expected '#usda' or 'PXR-USDC'`);
}

async function mark(file: Blob): Promise<string> {
  const bytes = new Uint8Array(await file.slice(0, 8).arrayBuffer());
  return [...bytes]
    .map((byte) => (byte > 31 && byte < 127 ? String.fromCharCode(byte) : "."))
    .join("");
}

/** The parser takes text that ends early as it is; a file that is not whole has open brackets. */
function refuseUnclosed(text: string): void {
  const open: string[] = [];
  const parts =
    /"""[\s\S]*?"""|'''[\s\S]*?'''|"(?:\\.|[^"\\\n])*"|'(?:\\.|[^'\\\n])*'|@[^@\n]*@|#.*|[[\](){}]/g;
  for (const [part] of text.matchAll(parts)) {
    const closes = "])}".indexOf(part);
    if (part.length > 1) continue;
    if (closes < 0) open.push(part);
    else if (open.pop() !== "[({"[closes])
      throw new Refusal(`does not open as USD: found '${part}' that closes nothing`);
  }
  if (open.length)
    throw new Refusal(
      `does not open as USD: ends with ${open.length} brackets open, expected none: the file is not whole`,
    );
}

function lacking(
  layer: Layer,
  skeletons: readonly string[],
  animations: readonly string[],
): string[] {
  const listed = animations.slice(0, SHOWN).join(", ");
  if (!skeletons.length) {
    const has = animations.length ? `${animations.length} animations and ` : "";
    const fault = `found ${has}no Skeleton, expected a SkelRoot with one`;
    if (!animations.length && !layer.references.length && !layer.prims("Mesh").length)
      throw new Refusal(fault);
    return [fault];
  }
  if (!animations.length)
    return [`found the skeleton ${skeletons[0]} without a SkelAnimation, expected one`];
  const bound = boundTo(layer, skeletons, animations);
  const several = skeletons.length > 1 && bound === null;
  return [
    ...(animations.length > 1
      ? [
          `found ${animations.length} animations (${listed}), expected one, or the path of one in the column clips.animation`,
        ]
      : []),
    ...(several
      ? [
          `found ${skeletons.length} skeletons (${skeletons.slice(0, SHOWN).join(", ")}), expected one that is bound to ${animations[0]}: export each character alone`,
        ]
      : []),
  ];
}

/** The one skeleton that is bound to the first animation. */
function boundTo(
  layer: Layer,
  skeletons: readonly string[],
  animations: readonly string[],
): string | null {
  const found = skeletons.filter((path) => animations[0] && layer.source(path) === animations[0]);
  return found.length === 1 ? found[0]! : null;
}

function treeOf(layer: Layer, prim: string): Tree {
  const paths = layer.words(`${prim}.joints`);
  if (!paths.length) throw new Refusal(`skeleton ${prim} is not valid: it names no joints`);
  if (paths.length > MOST_JOINTS)
    throw new Refusal(`found ${paths.length} joints, expected at most ${MOST_JOINTS}`);
  const parents = paths.map((path) => nearestAbove(paths, path));
  if (parents.some((parent, joint) => parent >= joint))
    throw new Refusal(`skeleton ${prim}: a joint stands before its parent`);
  const roots = paths.filter((_, joint) => parents[joint]! < 0);
  if (roots.length > 1)
    throw new Refusal(`found the root joints ${roots.slice(0, 5).join(", ")}, expected one`);
  const short = paths.map((path) => path.slice(path.lastIndexOf("/") + 1));
  const named = [layer.words(`${prim}.jointNames`), short].find(
    (names) => names.length === paths.length && new Set(names).size === names.length,
  );
  return { paths, names: named ?? paths, parents };
}

function nearestAbove(paths: readonly string[], path: string): number {
  for (let end = path.lastIndexOf("/"); end > 0; end = path.lastIndexOf("/", end - 1)) {
    const found = paths.indexOf(path.slice(0, end));
    if (found >= 0) return found;
  }
  return -1;
}

function takeOf(layer: Layer, path: string, pace: number): Take {
  const codes = layer.sampleCodes(path);
  const frames = codes.length;
  if (!frames)
    return {
      name: path,
      frames,
      fps: null,
      fault: "has no samples over time, expected an animation",
    };
  try {
    return {
      name: path,
      frames,
      fps: rateOfKeys(Float64Array.from(codes, (code) => code / pace)),
      fault: null,
    };
  } catch (fault) {
    if (!(fault instanceof Refusal)) throw fault;
    return { name: path, frames, fps: null, fault: fault.message };
  }
}

/** Places (J, 3) of the bind pose. */
function restOf(layer: Layer, prim: string, { names }: Tree): Float64Array {
  const matrices = layer.numbers(`${prim}.bindTransforms`);
  if (matrices.length !== 16 * names.length) return new Float64Array();
  return Float64Array.from(
    names.flatMap((_, joint) => matrices.slice(16 * joint + 12, 16 * joint + 15)),
  );
}

function posesOf(layer: Layer, animation: string, prim: string, tree: Tree): Pose[] {
  const own = layer.words(`${animation}.joints`);
  const codes = layer.sampleCodes(animation);
  const known = own.map((path) => tree.paths.indexOf(path));
  if (!known.some((joint) => joint >= 0))
    throw new Refusal(`${animation} moves no joint of ${prim}`);
  const rest = layer.numbers(`${prim}.restTransforms`);
  const still = tree.names.flatMap((_, joint) => rest.slice(16 * joint + 12, 16 * joint + 15));
  return pickedFrames(codes.length).map((frame) => {
    const [places, turns] = [
      layer.sample(`${animation}.translations`, codes[frame]!),
      layer.sample(`${animation}.rotations`, codes[frame]!),
    ];
    if (places.length !== 3 * own.length || turns.length !== 4 * own.length)
      throw new Refusal(
        `${animation} has ${places.length / 3} translations and ${turns.length / 4} rotations at time code ${codes[frame]}, expected ${own.length} of each`,
      );
    if (![...places, ...turns].every(Number.isFinite))
      throw new Refusal(`${animation} has broken numbers at time code ${codes[frame]}`);
    return arranged(known, places, turns, still);
  });
}

/** In the order of the skeleton; joints that the animation leaves out are at rest. */
function arranged(
  known: readonly number[],
  places: readonly number[],
  turns: readonly number[],
  still: readonly number[],
): Pose {
  const found = {
    places: Float64Array.from(still),
    turns: Float64Array.from({ length: (still.length / 3) * 4 }, (_, at) => (at % 4 === 3 ? 1 : 0)),
  };
  known.forEach((joint, column) => {
    if (joint < 0) return;
    found.places.set(places.slice(3 * column, 3 * column + 3), 3 * joint);
    const turn = turns.slice(4 * column, 4 * column + 4);
    const length = Math.hypot(...turn) || 1;
    found.turns.set(
      turn.map((each) => each / length),
      4 * joint,
    );
  });
  return found;
}
