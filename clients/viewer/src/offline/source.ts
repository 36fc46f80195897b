/** The model in the browser itself, which answers as a service does, to the rounding of float32. */

import type {
  ClipQuestion,
  CrowdPoses,
  CrowdQuestion,
  ModelCard,
  ModelSummary,
  Motion,
  PoseQuestion,
  Poses,
  SigmaGrid,
  SigmaQuestion,
  Trust,
} from "@posefield/client";

import type { Source } from "../page.ts";
import { type Deviation, deviations, merged, told } from "./bounds.ts";
import { type Course, closed, inPlace, times, type Way } from "./course.ts";
import { crowd } from "./crowd.ts";
import * as door from "./door.ts";
import { type Answers, Graph, type Ort } from "./graph.ts";
import { sigma } from "./grid.ts";
import { straightened } from "./plane.ts";
import { Support, type SupportTable } from "./support.ts";

/** The graph takes a time after the end for the end, s. */
const AFTER = 1e9;

/** A question about one character that has passed the door. */
interface Asked {
  readonly controls: Readonly<Record<string, number>>;
  readonly point: Float32Array;
  readonly weights: Float32Array;
  readonly performer: string | null;
  readonly labels: NonNullable<ClipQuestion["labels"]>;
  readonly level: number;
  readonly warnings: string[];
  readonly supported: boolean;
  readonly deviations: readonly Deviation[];
}

/** What `posefield page` writes beside the graphs. */
export interface Tables {
  readonly card: ModelCard;
  readonly support: SupportTable;
}

export class Offline implements Source {
  readonly #card: ModelCard;
  readonly #support: Support;
  readonly #graph: Graph;
  readonly #body: () => Promise<Uint8Array<ArrayBuffer>>;

  /** levels: the graph of each level; body: the character's file. */
  constructor(
    ort: Ort,
    levels: (level: number) => Promise<Uint8Array>,
    body: () => Promise<Uint8Array<ArrayBuffer>>,
    tables: Tables,
  ) {
    this.#body = body;
    this.#card = tables.card;
    this.#support = new Support(tables.support);
    this.#graph = new Graph(ort, levels, this.#card);
  }

  async models(): Promise<readonly ModelSummary[]> {
    const { identity, description } = this.#card;
    return [{ name: identity.split("@")[0]!, identity, versions: [identity], description }];
  }

  async card(): Promise<ModelCard> {
    return this.#card;
  }

  async character(): Promise<{ content: Uint8Array<ArrayBuffer> }> {
    return { content: await this.#body() };
  }

  async pose(_: string, question: PoseQuestion): Promise<Poses> {
    const asked = this.#asked(question);
    const when = Float64Array.from(question.times);
    const found = await this.#run(asked, when);
    const duration = door.sensible(this.#card, found.duration[0]!);
    for (const time of when) door.within("times", time, 0, duration);
    return {
      trust: this.#trust(asked, found),
      times: when,
      rotations: found.rotations,
      rootPosition: found.root_position,
      boneOffsets: found.bone_offsets,
      curves: found.curves ?? null,
    };
  }

  async clip(_: string, question: ClipQuestion): Promise<Motion> {
    if (question.loop && !this.#card.cyclic) {
      throw new door.Refused("loop: this model's last pose does not lead into its first");
    }
    if (question.unit || question.up || (question.names ?? "own") !== "own") {
      throw new door.NeedsService("another unit, up axis or naming");
    }
    const asked = this.#asked(question);
    const ends = await this.#run(asked, Float64Array.of(0, AFTER));
    const duration = door.sensible(this.#card, ends.duration[0]!);
    const when = times(question, duration);
    const found = await this.#run(asked, when);
    const poses = { times: when, rotations: found.rotations, rootPosition: found.root_position };
    const { names, parents } = this.#card.skeleton;
    const routed = this.#routed(poses, question, ends, duration);
    return {
      trust: this.#trust(asked, found),
      ...routed,
      boneOffsets: found.bone_offsets,
      curves: found.curves ? curvesOf(found.curves, when, routed) : null,
      curveNames: this.#card.curves?.map(({ name }) => name) ?? [],
      names,
      parents,
      rate: question.fps ?? 30,
      frames: routed.times.length,
      units: {},
    } as Motion;
  }

  crowd(_: string, question: CrowdQuestion): Promise<CrowdPoses> {
    return crowd(this.#graph, this.#card, this.#support, question);
  }

  sigma(_: string, question: SigmaQuestion): Promise<SigmaGrid> {
    return sigma(this.#graph, this.#card, this.#support, question);
  }

  async why(): Promise<never> {
    throw new door.NeedsService("what an answer is made of");
  }

  /** The poses in place, or closed, as asked for. */
  #routed(poses: Course, asked: ClipQuestion, ends: Answers, duration: number): Course {
    const way = this.#card.cyclic ? stride(ends) : straight(ends);
    const stays = asked.root === "in_place" && this.#card.root === "travelling";
    const placed = stays ? inPlace(poses, way, duration) : poses;
    return asked.loop ? closed(placed, stays ? null : way, duration) : placed;
  }

  #asked(
    question: Pick<ClipQuestion, "controls" | "performer" | "labels" | "level" | "extrapolate">,
  ): Asked {
    const values = door.point(this.#card, question.controls);
    const policy = question.extrapolate ?? "warn";
    const found = door.warnings(this.#card, values);
    const supported = this.#support.holds(values);
    const said = found.length || supported ? found : [door.GAP];
    if (policy === "refuse" && said.length) throw new door.Refused(said.join("; "));
    const apart = deviations(this.#card, values);
    return {
      controls: question.controls,
      point: Float32Array.from(values),
      weights: Float32Array.from(door.weights(this.#card, question)),
      performer: question.performer ?? null,
      labels: question.labels ?? {},
      level: door.level(this.#card, question.level ?? 0),
      warnings: policy === "warn" ? merged(said, apart) : [],
      supported,
      deviations: apart,
    };
  }

  #run(asked: Asked, when: Float64Array): Promise<Answers> {
    const times = Float32Array.from(when);
    const { level, point, weights } = asked;
    return this.#graph.run({ count: 1, controls: point, times, labels: weights }, level);
  }

  #trust(asked: Asked, found: Answers): Trust {
    const { controls, performer, level, supported, warnings } = asked;
    const [duration, sigma] = [found.duration[0]!, found.sigma[0]!];
    const model = this.#card.identity;
    const seen = this.#card.performers.length ? { performer_seen: performer !== null } : {};
    const own = { model, controls, performer, level, duration, sigma, supported, warnings };
    const labels = Object.keys(asked.labels).length ? { labels: asked.labels } : {};
    return { ...own, ...labels, ...seen, ...told(asked.deviations, sigma) } as Trust;
  }
}

/** The curves of the frames, and of the first again where a loop repeats it. */
function curvesOf(curves: Float32Array, when: Float64Array, routed: Course): Float32Array {
  if (routed.times.length === when.length) return curves;
  const width = curves.length / when.length;
  return new Float32Array([...curves, ...curves.subarray(0, width)]);
}

/** What one cycle does, as its end says (service/posefield/locomotion/stride.py). */
function stride(ends: Answers): Way {
  const { travel, root_position: roots } = ends;
  const gap = { x: travel[3]!, z: travel[4]! };
  const turn = travel[5]!;
  const start = { x: roots[3]! - gap.x, z: roots[5]! - gap.z };
  return { way: straightened(gap, turn), turn, start };
}

/** The straight way from the first pose to the last. */
function straight({ root_position: roots }: Answers): Way {
  const start = { x: roots[0]!, z: roots[2]! };
  return { way: { x: roots[3]! - start.x, z: roots[5]! - start.z }, turn: 0, start };
}
