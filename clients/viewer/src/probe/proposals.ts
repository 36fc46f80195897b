/** Proposals for the settings of a recipe, with their evidence, in the words of `posefield probe`. */

import { limbs, pathTo } from "./limbs.ts";
import type { Motion } from "./motion.ts";
import { general, mean, median, plain } from "./numbers.ts";

export type Confidence = "certain" | "high" | "medium" | "low" | "none";

/** value: null where none is proposed. */
export interface Proposal<Value> {
  readonly value: Value | null;
  readonly confidence: Confidence;
  readonly evidence: readonly string[];
}

const ADULT_LEG = 0.86;
const ADULT_SIZE = 1.7;
/** Largest factors between the proposed length and an adult's for a high and a medium confidence. */
const [HIGH, MEDIUM] = [1.2, 1.35];
const UNITS = [
  ["millimetres", 0.001],
  ["centimetres", 0.01],
  ["inches", 0.0254],
  ["ASF units", 0.0564444],
  ["decimetres", 0.1],
  ["feet", 0.3048],
  ["metres", 1],
] as const;
const AXES = "xyz";

/** The figure of a motion: its joints by role, and places to measure. */
export class Figure {
  readonly motion: Motion;
  readonly roles: ReadonlyMap<string, number>;
  readonly positions: readonly Float64Array[];

  constructor(motion: Motion) {
    this.motion = motion;
    this.roles = limbs(motion.names, motion.parents);
    // Without motion the figure at rest is what there is.
    const still = motion.rest.length ? [motion.rest] : [];
    this.positions = motion.positions.length ? motion.positions : still;
  }

  get legLength(): number | null {
    const known = ["left", "right"].flatMap((side) => {
      const [top, end] = [this.roles.get(`${side}UpperLeg`), this.roles.get(`${side}Foot`)];
      if (top === undefined || end === undefined) return [];
      const path = pathTo(this.motion.parents, end);
      const bones = path.includes(top) ? path.slice(path.indexOf(top) + 1) : [];
      const length = bones.reduce((sum, joint) => sum + this.#bone(joint), 0);
      return length > 0 ? [length] : [];
    });
    return known.length ? mean(known) : null;
  }

  /** The largest extent of the joints along an axis. */
  get size(): number {
    const sizes = this.positions.map((all) =>
      Math.max(...[0, 1, 2].map((axis) => extent(along(all, axis)))),
    );
    return sizes.length ? median(sizes) : 0;
  }

  #bone(joint: number): number {
    const parent = this.motion.parents[joint]!;
    const lengths = this.positions.map((all) =>
      Math.hypot(...[0, 1, 2].map((axis) => all[3 * joint + axis]! - all[3 * parent + axis]!)),
    );
    return lengths.length ? median(lengths) : 0;
  }
}

export function proposeUnit(figure: Figure): Proposal<number> {
  const measured = measuredUnit(figure);
  return stated(figure.motion.metresPerUnit, measured, plain, " m") ?? measured;
}

export function proposeUp(figure: Figure): Proposal<string> {
  const measured = measuredUp(figure);
  return stated(figure.motion.up, measured, String, "") ?? measured;
}

export function proposeRate({ takes, rateSaid }: Motion): Proposal<number> {
  const fps = takes[0]?.fps ?? null;
  if (fps === null)
    return {
      value: null,
      confidence: "none",
      evidence: ["the files state no rate: ask who captured them"],
    };
  return { value: fps, confidence: "certain", evidence: [`${rateSaid} in the files`] };
}

/** What the file states, with what is measured beside it; doubtful where that contradicts it. */
function stated<Value>(
  said: Value | null,
  measured: Proposal<Value>,
  write: (value: Value) => string,
  unit: string,
): Proposal<Value> | null {
  if (said === null) return null;
  const doubtful = measured.confidence === "high" && measured.value !== said;
  const against = doubtful
    ? `, which the motion contradicts: ${write(measured.value!)}${unit} fits it`
    : "";
  const evidence = [`stated by the files: ${write(said)}${unit}${against}`, ...measured.evidence];
  return { value: said, confidence: doubtful ? "low" : "certain", evidence };
}

function measuredUnit(figure: Figure): Proposal<number> {
  const leg = figure.legLength;
  const length = leg ?? figure.size;
  const [usual, what] = leg ? [ADULT_LEG, "leg, hip to foot"] : [ADULT_SIZE, "largest extent"];
  if (!(length > 0)) return { value: null, confidence: "none", evidence: [`${what}: no length`] };
  const apart = ([, metres]: (typeof UNITS)[number]) =>
    Math.abs(Math.log((length * metres) / usual));
  const [first, second, third] = UNITS.toSorted((a, b) => apart(a) - apart(b)) as [
    Unit,
    Unit,
    Unit,
  ];
  const factor = Math.exp(apart(first));
  const fits = factor < HIGH ? "high" : factor < MEDIUM ? "medium" : "low";
  const size = (unit: Unit) => `${general(length * unit[1], 3)} m in ${unit[0]}`;
  return {
    value: first[1],
    confidence: leg ? fits : "low",
    evidence: [
      `${what}: ${general(length, 4)} units, which is ${(length * first[1]).toFixed(2)} m in ${first[0]}; of an adult about ${usual} m`,
      `the next units: ${size(second)}, ${size(third)}`,
      ...(leg ? [] : ["no legs were recognised by their names"]),
    ],
  };
}

type Unit = (typeof UNITS)[number];
type Vote = readonly [string, string];

/** The up axis, from the bodies in motion, the floor under their feet, and at rest. */
function measuredUp(figure: Figure): Proposal<string> {
  const { motion, positions } = figure;
  const votes = [
    bodyAxis(figure, positions, "from the feet to the head"),
    floorAxis(figure),
    bodyAxis(figure, motion.rest.length ? [motion.rest] : [], "from the feet to the head at rest"),
  ].filter((vote) => vote !== null);
  const evidence = votes.map(([, said]) => said);
  const first = votes[0]?.[0];
  if (first === undefined)
    return {
      value: null,
      confidence: "none",
      evidence: ["neither a head nor feet were recognised"],
    };
  const agreeing = votes.filter(([axis]) => axis === first).length;
  if (first !== "+y" && first !== "+z") {
    const said = `the up axis seems to be ${first}; only +y and +z can be read`;
    return { value: null, confidence: "none", evidence: [...evidence, said] };
  }
  const agreed = agreeing === votes.length && agreeing > 1 ? "high" : "medium";
  const confidence = agreeing * 2 < votes.length ? "low" : agreed;
  return { value: first[1]!, confidence, evidence };
}

/** The axis of the mean direction from the feet to the head. */
function bodyAxis(
  { roles }: Figure,
  positions: readonly Float64Array[],
  what: string,
): Vote | null {
  const [head, left, right] = ["head", "leftFoot", "rightFoot"].map((role) => roles.get(role));
  if (head === undefined || left === undefined || right === undefined) return null;
  if (!positions.length) return null;
  const direction = [0, 1, 2].map((axis) =>
    mean(
      positions.map(
        (all) => all[3 * head + axis]! - (all[3 * left + axis]! + all[3 * right + axis]!) / 2,
      ),
    ),
  );
  const length = Math.max(Math.hypot(...direction), 1e-12);
  const shares = direction.map((each) => each / length);
  const axis = indexOfLeast(shares.map((share) => -Math.abs(share)));
  const name = (shares[axis]! > 0 ? "+" : "-") + AXES[axis];
  return [
    name,
    `${what}: ${name}, ${(100 * Math.abs(shares[axis]!)).toFixed(0)}% of the direction`,
  ];
}

/** The axis along which the lowest joint stays most nearly at one height. */
function floorAxis(figure: Figure): Vote | null {
  const { positions, motion } = figure;
  if (motion.positions.length === 0) return null;
  const moving = motion.names
    .map((_, joint) => joint)
    .filter((joint) => isMoving(positions, joint));
  const body = moving.length ? moving : motion.names.map((_, joint) => joint);
  const ends = [Math.min, Math.max].flatMap((end) =>
    [0, 1, 2].map((axis) =>
      deviation(positions.map((all) => end(...body.map((joint) => all[3 * joint + axis]!)))),
    ),
  );
  const spread = ends.map((each) => each / Math.max(figure.size, 1e-12));
  const best = indexOfLeast(spread);
  const others = Math.min(...spread.filter((_, at) => at !== best));
  const name = (best < 3 ? "+" : "-") + AXES[best % 3];
  const percent = (share: number) => `${(100 * share).toFixed(1)}%`;
  return [
    name,
    `lowest joint along ${name}: moves by ${percent(spread[best]!)} of the figure's size, along any other axis by ${percent(others)} or more`,
  ];
}

function isMoving(positions: readonly Float64Array[], joint: number): boolean {
  const same = (all: Float64Array, at: number) => all[at] === positions[0]![at];
  return positions.some((all) => [0, 1, 2].some((axis) => !same(all, 3 * joint + axis)));
}

function along(all: Float64Array, axis: number): number[] {
  return [...all].filter((_, at) => at % 3 === axis);
}

function extent(values: readonly number[]): number {
  return Math.max(...values) - Math.min(...values);
}

function deviation(values: readonly number[]): number {
  const middle = mean(values);
  return Math.sqrt(mean(values.map((each) => (each - middle) ** 2)));
}

function indexOfLeast(values: readonly number[]): number {
  return values.indexOf(Math.min(...values));
}
