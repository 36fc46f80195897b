/** Walkers that are steered: speed and turning change at any time, and feet stand. */

import * as limits from "./constants.ts";
import { InvalidField } from "./errors.ts";
import { need, placeLeg } from "./feet.ts";
import { findLegs, type Limb, LimbPoses, quaternionAt } from "./limbs.ts";
import { finite, type Model, type Options, type Poses, range } from "./model.ts";
import type { Point } from "./session.ts";
import { cycleOf, relativeRoot, type Stride } from "./strides.ts";
import {
  add,
  type Complex,
  clamp,
  direction,
  multiply,
  normalized,
  type Quaternion,
  rotate,
  scale,
  scaled,
  subtract,
  sum,
  times,
  turn,
  type Vector,
} from "./vectors.ts";

/** Speed ahead, m/s, and rate of turning to the left, rad/s. */
export interface Steering {
  readonly speed: number;
  readonly turn: number;
}

/** Largest changes of speed, m/s², and of turning, rad/s². */
const ACCELERATION = 2.5;
const TURN_ACCELERATION = 8;
/** Below this speed a walker stands, m/s. */
const IDLE = 0.12;
/** Time in which a foot leaves the place where it stood, and that of a step on the spot, s. */
const RELEASE = 0.3;
const STEP = 0.4;
/** Distance, m, and turn, rad, from where a standing foot would be that make it step. */
const [FAR, TWISTED] = [0.06, 0.4];
/** Distance at which a foot is let go whatever the model says, m. */
const LOST = 0.2;
/** Time constant with which the pelvis and the heights of feet follow, s. */
const SETTLE = 0.06;
/** Rise of a foot that steps on the spot, m. */
const RISE = 0.05;
const PHASES = 48;
const UP: Vector = [0, 1, 0];

/** Foot of a walker: where it stands, or how it left. */
interface FootState {
  standing: boolean;
  /** Place of the ball while it stands, or where a step on the spot began, m, and its heading. */
  place: Vector;
  yaw: number;
  /** From the prediction to the place, when the foot was let go. */
  offset: Vector;
  twist: number;
  /** Time since then, s; a step on the spot ends after STEP. */
  since: number;
  steps: boolean;
  /** Height above the goal, which fades, m. */
  above: number;
  ball: Vector;
}

interface WalkerState {
  steering: Steering;
  speed: number;
  turning: number;
  phase: number;
  place: Complex;
  heading: number;
  moves: boolean;
  lowered: number;
  /** Length of a stride, m. */
  length: number;
  readonly feet: FootState[];
}

/** Controls of a walk by speed and turn, and the pose in which walkers stand. */
interface Gait {
  readonly point: Point;
  /** Smallest and largest speed, m/s, and turn, degrees a cycle. */
  readonly speeds: readonly [number, number];
  readonly turns: readonly [number, number];
  readonly controls: (speed: number, turned: number) => number[];
  readonly length: number;
  readonly rotations: Float32Array;
  readonly root: Vector;
  readonly bones: Float32Array;
  /** Phases at which the feet leave the floor. */
  readonly liftOffs: readonly number[];
}

/** Walkers of one model and one performer; their poses are in the world. */
export class Walkers {
  /** Of all walkers, one after another. */
  readonly poses: Pick<Poses, "names" | "parents" | "rotations" | "rootPosition" | "boneOffsets">;
  readonly #model: Model;
  readonly #gait: Gait;
  readonly #legs: readonly Limb[];
  readonly #walkers: readonly WalkerState[];

  private constructor(model: Model, gait: Gait, count: number) {
    const { names, parents } = model.card.skeleton;
    this.#model = model;
    this.#gait = gait;
    this.#legs = findLegs(model.card);
    this.poses = {
      names,
      parents,
      rotations: new Float32Array(4 * names.length * count),
      rootPosition: new Float32Array(3 * count),
      boneOffsets: gait.bones,
    };
    this.#walkers = Array.from({ length: count }, () => standingWalker(gait, this.#legs.length));
    for (let index = 0; index < count; index++) this.put(index, [0, 0], 0);
  }

  static async of(model: Model, count: number, options: Options): Promise<Walkers> {
    if (!Number.isInteger(count) || count < 1)
      throw new InvalidField("count", `${count}, expected a whole number of 1 or more`);
    return new Walkers(model, await gaitOf(model, options), count);
  }

  /** Slowest and fastest captured walk, m/s; walkers stand, and walk slower, too. */
  get speeds(): readonly [number, number] {
    return this.#gait.speeds;
  }

  /** Place, x and z in m, heading, rad, and speed, m/s, of a walker now. */
  state(index: number) {
    const { place, heading, speed } = this.#walkers[index]!;
    return { x: place[1], z: place[0], heading, speed };
  }

  /** For each foot of a walker: whether it stands. */
  standing(index: number): readonly boolean[] {
    return this.#walkers[index]!.feet.map(({ standing }) => standing);
  }

  /** Put a standing walker somewhere: x and z, m, and a heading, rad. */
  put(index: number, [x, z]: readonly [number, number], heading: number): void {
    const state = Object.assign(this.#walkers[index]!, standingWalker(this.#gait, 0), {
      feet: this.#walkers[index]!.feet,
      place: [z, x],
      heading,
    });
    const poses = this.#pose(index, this.#gait.rotations, this.#gait.root);
    for (const [leg, foot] of state.feet.entries()) {
      const limb = this.#legs[leg]!;
      const contact = this.#model.card.contacts[limb.contact]!;
      const [ballX, , ballZ] = poses.position(limb.tip, 0);
      const place: Vector = [ballX, contact.height, ballZ];
      const yaw = yawOf(poses.between(limb.lower, limb.tip, 0));
      Object.assign(foot, newFoot(), { standing: true, place, yaw, ball: place });
    }
    this.#stand(
      index,
      poses,
      0,
      state.feet.map(() => true),
    );
  }

  /** Steer a walker from the next step on. */
  steer(index: number, { speed, turn: turned }: Steering): void {
    const within = clamp(finite("speed", speed), 0, this.speeds[1]);
    this.#walkers[index]!.steering = { speed: within, turn: finite("turn", turned) };
  }

  /** Steer a walker to a point, x and z in m, where it stops; the distance left, m. */
  steerTo(index: number, [x, z]: readonly [number, number], speed: number): number {
    const { place, heading } = this.#walkers[index]!;
    const distance = Math.hypot(x - place[1], z - place[0]);
    const angle = wrapped(Math.atan2(x - place[1], z - place[0]) - heading);
    const near = clamp(distance - 0.2, 0, 1);
    const ahead = Math.max(Math.cos(angle), 0.2) * near;
    this.steer(index, { speed: speed * ahead, turn: near > 0 ? clamp(3 * angle, -2.5, 2.5) : 0 });
    return distance;
  }

  /** Move all walkers on by some seconds, of a frame. */
  async step(seconds: number): Promise<void> {
    range("seconds", seconds, 0, 3600, "s");
    const { card, session } = this.#model;
    const controls = this.#walkers.map((walker) => this.#accelerate(walker, seconds));
    const point = { ...this.#gait.point, controls };
    const strides = await stridesOf(this.#model, point);
    const times = strides.map((stride, index) => {
      advance(this.#walkers[index]!, stride, this.#gait.liftOffs, seconds);
      return this.#walkers[index]!.phase * stride.duration;
    });
    const { rotations, root_position, contacts } = await session.run(
      point,
      times,
      ...(["rotations", "root_position", "contacts"] as const),
    );
    const joints = card.skeleton.names.length;
    for (const [index, stride] of strides.entries()) {
      const { phase, speed, moves } = this.#walkers[index]!;
      const local = rotations.subarray(4 * joints * index, 4 * joints * (index + 1));
      const { root, heading } = relativeRoot(stride, phase, root_position, index);
      local.set(multiply(heading, quaternionAt(local, 0)));
      const share = clamp(speed / this.speeds[0], 0, 1);
      const weight = share * share * (3 - 2 * share);
      blend(local, this.#gait.rotations, weight);
      const mixed = add(scale(root, weight), scale(this.#gait.root, 1 - weight));
      const down = this.#legs.map(
        ({ contact }) =>
          !moves || contacts[index * card.contacts.length + contact]! > limits.STANDING,
      );
      this.#stand(index, this.#pose(index, local, mixed), seconds, down);
    }
  }

  /** Change the speed and the turning of a walker as it is steered; the controls for them. */
  #accelerate(walker: WalkerState, seconds: number): number[] {
    const { speed, turn: turning } = walker.steering;
    const [most, mostTurning] = [ACCELERATION * seconds, TURN_ACCELERATION * seconds];
    walker.speed += clamp(speed - walker.speed, -most, most);
    walker.turning += clamp(turning - walker.turning, -mostTurning, mostTurning);
    const pace = clamp(walker.speed, ...this.speeds);
    const turned = (walker.turning * walker.length * 180) / (Math.PI * pace);
    return this.#gait.controls(pace, clamp(turned, ...this.#gait.turns));
  }

  /** Joints of the legs of a walker; its rotations and root are written to the poses. */
  #pose(index: number, local: Float32Array, root: Vector): LimbPoses {
    const { parents, rotations, rootPosition } = this.poses;
    const { place, heading } = this.#walkers[index]!;
    const [z, x] = times(direction(heading), [root[2], root[0]]);
    const at = 4 * parents.length * index;
    rotations.set(local, at);
    rotations.set(multiply(turn(UP, heading), quaternionAt(local, 0)), at);
    rootPosition.set([place[1] + x, root[1], place[0] + z], 3 * index);
    return new LimbPoses(
      parents,
      this.#legs.map(({ tip }) => tip),
      {
        frames: 1,
        rotations: rotations.subarray(at),
        roots: rootPosition.subarray(3 * index),
        bones: this.poses.boneOffsets,
      },
    );
  }

  /** Stand, release and place the feet of a walker. down: feet that the model has on the floor. */
  #stand(index: number, poses: LimbPoses, seconds: number, down: readonly boolean[]): void {
    const walker = this.#walkers[index]!;
    const { parents, rotations, rootPosition } = this.poses;
    const balls = walker.feet.map((foot, leg) => {
      const limb = this.#legs[leg]!;
      const contact = this.#model.card.contacts[limb.contact]!;
      const predicted = poses.position(limb.tip, 0);
      const yaw = yawOf(poses.between(limb.lower, limb.tip, 0));
      const others = walker.feet.every((other) => other === foot || other.standing);
      moveFoot(foot, predicted, yaw, contact.height, seconds, down[leg]!, !walker.moves && others);
      return { limb, contact, foot, yaw };
    });
    const needs = balls.map(({ limb, foot }) =>
      foot.standing ? need(poses, limb, 0, foot.ball, 0) : 0,
    );
    const goal = Math.min(Math.max(...needs), 2 * limits.MOST_LOWERED);
    walker.lowered += (goal - walker.lowered) * -Math.expm1(-seconds / SETTLE);
    for (const { limb, contact, foot, yaw } of balls) {
      const drop = limb.toe ? rotate(poses.orientation(limb.tip, 0), limb.toe)[1] : 0;
      const twist = foot.standing ? wrapped(foot.yaw - yaw) : fade(foot) * foot.twist;
      const lowest = contact.height + Math.min(drop, 0) - foot.ball[1];
      const shift: Vector = [0, -walker.lowered, 0];
      const turns = placeLeg(poses, limb, 0, shift, foot.ball, lowest, turn(UP, twist));
      for (const [joint, local] of turns)
        rotations.set(local, 4 * (parents.length * index + joint));
    }
    rootPosition[3 * index + 1]! -= walker.lowered;
  }
}

/** Move a walker on: its heading, phase and place. */
function advance(
  walker: WalkerState,
  { way }: Stride,
  liftOffs: readonly number[],
  seconds: number,
): void {
  walker.heading = wrapped(walker.heading + walker.turning * seconds);
  walker.length = Math.hypot(...way);
  const moves = walker.speed > IDLE || walker.steering.speed > IDLE;
  // A walk begins as the foot that stands farther back leaves the floor.
  if (moves && !walker.moves) walker.phase = liftOffs[rearFoot(walker)]!;
  walker.moves = moves;
  if (moves) walker.phase += (walker.speed * seconds) / walker.length;
  walker.phase -= Math.floor(walker.phase);
  const drift = Math.atan2(way[1], way[0]);
  const gone = scaled(direction(walker.heading + drift), walker.speed * seconds);
  walker.place = sum(walker.place, gone);
}

/** Move a foot on: it stands in its place, swings as predicted, or steps on the spot. */
function moveFoot(
  foot: FootState,
  predicted: Vector,
  yaw: number,
  height: number,
  seconds: number,
  down: boolean,
  maySteps: boolean,
): void {
  const [x, y, z] = predicted;
  const away = Math.hypot(foot.place[0] - x, foot.place[2] - z);
  const twist = wrapped(foot.yaw - yaw);
  foot.since += seconds;
  if (foot.standing) {
    const steps = maySteps && (away > FAR || Math.abs(twist) > TWISTED);
    if (steps || !down || away > LOST) {
      const offset = subtract(foot.ball, predicted);
      Object.assign(foot, { standing: false, offset, twist, since: 0, steps, place: foot.ball });
    }
  } else if (foot.steps ? foot.since >= STEP : down && foot.since > 0.5 * RELEASE) {
    const place: Vector = [foot.ball[0], height, foot.ball[2]];
    const landed = yaw + fade(foot) * foot.twist;
    const above = foot.ball[1] - height;
    Object.assign(foot, { standing: true, steps: false, place, yaw: landed, above });
  }
  if (foot.standing) {
    foot.above *= Math.exp(-seconds / SETTLE);
    const level = height + clamp(y - height, -limits.SUNK, limits.UNEVEN);
    foot.ball = [foot.place[0], level + foot.above, foot.place[2]];
  } else {
    const moved = add(predicted, scale(foot.offset, fade(foot)));
    const share = clamp(foot.since / (foot.steps ? STEP : RELEASE), 0, 1);
    const lift = foot.steps
      ? RISE * Math.sin(Math.PI * share)
      : Math.min(limits.LEAST_LIFT, Math.max(y - height, 0)) * share;
    foot.ball = [moved[0], Math.max(foot.steps ? 0 : moved[1], height + lift), moved[2]];
  }
}

/** Share of a foot's offset from its prediction that is left since it was let go. */
function fade({ since, steps }: FootState): number {
  const share = clamp(since / (steps ? STEP : RELEASE), 0, 1);
  return 1 - share * share * (3 - 2 * share);
}

function newFoot(): FootState {
  const zero: Vector = [0, 0, 0];
  return {
    ...{ standing: true, steps: false, place: zero, yaw: 0, offset: zero, twist: 0, since: 0 },
    ...{ above: 0, ball: zero },
  };
}

function standingWalker({ length }: Gait, legs: number): WalkerState {
  const feet = Array.from({ length: legs }, newFoot);
  const still = { speed: 0, turn: 0 };
  return {
    ...{ steering: still, speed: 0, turning: 0, phase: 0, place: [0, 0], heading: 0 },
    ...{ moves: false, lowered: 0, length, feet },
  };
}

/** The foot that is farther back. */
function rearFoot({ feet, place, heading }: WalkerState): number {
  const ahead = feet.map(({ ball }) => {
    const back = direction(-heading);
    return times(back, [ball[2] - place[0], ball[0] - place[1]])[0];
  });
  return ahead.indexOf(Math.min(...ahead));
}

/** Measure strides and the standing pose of a walk; InvalidField for a model that is none. */
async function gaitOf(model: Model, options: Options): Promise<Gait> {
  const { card, session } = model;
  const [pace, bend] = ["speed", "turn"].map((quantity) =>
    card.controls.findIndex(({ measure }) => measure?.quantity === quantity),
  ) as [number, number];
  if (!model.walks)
    throw new InvalidField("model", `${card.name} is no walk with a measured speed and known legs`);
  const { minimum, maximum } = card.controls[pace]!;
  const side = card.controls[bend] ?? { minimum: 0, maximum: 0 };
  const turns = [side.minimum, side.maximum] as const;
  /** Other controls are the mean of captured clips with a similar speed. */
  const controls = (speed: number, turned: number) => {
    const width = (maximum - minimum) / 6;
    const weights = card.examples.map((row) => Math.exp(-(((row[pace]! - speed) / width) ** 2)));
    const total = weights.reduce((sum, weight) => sum + weight, 0);
    return card.controls.map((_, index) => {
      if (index === pace) return speed;
      if (index === bend) return turned;
      return (
        card.examples.reduce((sum, row, clip) => sum + weights[clip]! * row[index]!, 0) / total
      );
    });
  };
  const slow = controls(minimum, clamp(0, ...turns));
  const point = { ...model.point(model.defaults, options), controls: [slow] };
  const slowest = (await stridesOf(model, point))[0]!;
  const phases = Array.from({ length: PHASES }, (_, index) => index / PHASES);
  const cycle = await session.run(
    point,
    phases.map((phase) => phase * slowest.duration),
    ...(["rotations", "root_position", "bone_offsets", "contacts"] as const),
  );
  const joints = card.skeleton.names.length;
  const rotations = new Float32Array(4 * joints);
  let root: Vector = [0, 0, 0];
  for (const [index, phase] of phases.entries()) {
    const local = cycle.rotations.subarray(4 * joints * index, 4 * joints * (index + 1));
    const relative = relativeRoot(slowest, phase, cycle.root_position, index);
    local.set(multiply(relative.heading, quaternionAt(local, 0)));
    blend(rotations, local, index / (index + 1));
    root = add(root, scale(relative.root, 1 / PHASES));
  }
  const liftOffs = findLegs(card).map(({ contact }) => {
    const likely = (index: number) =>
      cycle.contacts[(index % PHASES) * card.contacts.length + contact]! > limits.STANDING;
    return (
      Math.max(
        phases.findIndex((_, index) => likely(index) && !likely(index + 1)),
        0,
      ) / PHASES
    );
  });
  return {
    ...{ point, speeds: [minimum, maximum], turns, controls, length: Math.hypot(...slowest.way) },
    ...{ rotations, root, bones: cycle.bone_offsets, liftOffs },
  };
}

/** The stride of each point. */
async function stridesOf({ session }: Model, point: Point): Promise<Stride[]> {
  const ends = await session.run(
    point,
    point.controls.map(() => limits.AFTER_END),
    ...(["duration", "travel", "root_position"] as const),
  );
  return point.controls.map((_, row) => cycleOf(ends, row, ends.duration[row]!));
}

/** Mix rotations with others, of which 1 - weight is taken, along the shorter arcs. */
function blend(rotations: Float32Array, others: Float32Array, weight: number): void {
  for (let at = 0; at < rotations.length; at += 4) {
    const [a, b] = [quaternionAt(rotations, at / 4), quaternionAt(others, at / 4)];
    const dot = a[0] * b[0] + a[1] * b[1] + a[2] * b[2] + a[3] * b[3];
    const other = dot < 0 ? weight - 1 : 1 - weight;
    const mixed = a.map((value, axis) => weight * value + other * b[axis]!);
    rotations.set(normalized(mixed as unknown as Quaternion), at);
  }
}

function yawOf([x, , z]: Vector): number {
  return Math.atan2(x, z);
}

function wrapped(angle: number): number {
  return angle - 2 * Math.PI * Math.round(angle / (2 * Math.PI));
}
