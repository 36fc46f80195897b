/** A source of answers without a service: those of a table, and what lies between them. */

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

import { curvesAt } from "../curves.ts";
import type { Source } from "../page.ts";
import { pose as posture, sample } from "../playback.ts";
import * as columns from "./columns.ts";
import * as door from "./door.ts";
import type { Tables } from "./read.ts";
import { remark } from "./remark.ts";
import { sigma } from "./sigma.ts";
import type { Answer, Table } from "./table.ts";

/** A clip's time that a caller has rounded, as a share of it; levels differ in how long it takes. */
const [ROUNDING, COARSE] = [1e-5, 0.1];

/** A question about one character that has passed the door. */
interface Asked {
  readonly question: Pick<ClipQuestion, "controls" | "extrapolate"> & door.Named;
  readonly values: readonly number[];
  readonly names: door.Names;
  readonly level: number;
}

export class Offline implements Source {
  readonly #tables: Tables;
  readonly #table: Table;
  readonly #body: () => Uint8Array<ArrayBuffer>;
  readonly remark: string;
  readonly open: readonly string[];

  /** body: the character's file. */
  constructor(tables: Tables, table: Table, body: () => Uint8Array<ArrayBuffer>) {
    this.#tables = tables;
    this.#table = table;
    this.#body = body;
    this.remark = remark(tables);
    const { named } = tables.answers;
    const sets = (tables.card.labels ?? []).map(({ name }) => name);
    this.open = sets.filter((name) => name !== named);
  }

  async models(): Promise<readonly ModelSummary[]> {
    const { identity, description } = this.#card;
    return [{ name: identity.split("@")[0]!, identity, versions: [identity], description }];
  }

  async card(): Promise<ModelCard> {
    return this.#card;
  }

  async character(): Promise<{ content: Uint8Array<ArrayBuffer> }> {
    return { content: this.#body() };
  }

  async pose(_: string, question: PoseQuestion): Promise<Poses> {
    predicted(question);
    const clip = this.#motion(this.#asked(question), "travelling");
    for (const time of question.times) door.within("times", time, 0, clip.trust.duration);
    const found = question.times.map((time) => at(clip, time));
    return {
      trust: clip.trust,
      times: Float64Array.from(question.times),
      rotations: columns.joined(found.map(({ rotations }) => rotations)),
      rootPosition: columns.joined(found.map(({ root }) => root)),
      boneOffsets: clip.boneOffsets,
      curves: clip.curves && columns.joined(question.times.map((time) => curvesAt(clip, time)!)),
    };
  }

  /** The frames of the table, evenly over the clip, at whatever rate they are asked for. */
  async clip(_: string, question: ClipQuestion): Promise<Motion> {
    if (question.loop && !this.#card.cyclic) {
      throw new door.Refused("loop: this model's last pose does not lead into its first");
    }
    predicted(question);
    if (question.unit || question.up || (question.names ?? "own") !== "own") {
      throw new door.NeedsService("another unit, up axis or naming");
    }
    return this.#motion(this.#asked(question), question.root ?? "travelling");
  }

  async crowd(_: string, question: CrowdQuestion): Promise<CrowdPoses> {
    const rows = columns.rows(question).map((row) => this.#row(row, question.root));
    const { skeleton, identity, curves = [] } = this.#card;
    return {
      model: identity,
      names: skeleton.names,
      parents: skeleton.parents,
      warnings: [...new Set(rows.flatMap(({ asked }) => asked.names.left))],
      rotations: columns.joined(rows.map(({ now }) => now.rotations)),
      rootPosition: columns.joined(rows.map(({ now }) => now.root)),
      boneOffsets: columns.joined(rows.map(({ clip }) => clip.boneOffsets)),
      duration: Float32Array.from(rows, ({ clip }) => clip.trust.duration),
      sigma: Float32Array.from(rows, ({ clip }) => clip.trust.sigma),
      supported: rows.map(({ clip }) => clip.trust.supported ?? false),
      levels: Int32Array.from(rows, ({ clip }) => clip.trust.level),
      errorPx: null,
      curveNames: curves.map(({ name }) => name),
      curves: curves.length
        ? columns.joined(rows.map(({ clip, time }) => curvesAt(clip, time)!))
        : null,
    };
  }

  async sigma(_: string, question: SigmaQuestion): Promise<SigmaGrid> {
    return sigma(this.#tables, this.#table, question);
  }

  async why(): Promise<never> {
    throw new door.NeedsService("what an answer is made of");
  }

  get #card(): ModelCard {
    return this.#tables.card;
  }

  #row(row: columns.Row, root: CrowdQuestion["root"]) {
    const asked = this.#asked(row);
    const clip = this.#motion(asked, root ?? "travelling");
    const slack = 1 + (asked.level ? COARSE : ROUNDING);
    door.within("time", row.time, 0, clip.trust.duration * slack);
    return { asked, clip, time: row.time, now: at(clip, row.time) };
  }

  #asked(question: Asked["question"] & { readonly level?: number }): Asked {
    const card = this.#card;
    return {
      question,
      values: door.point(card, this.#tables.answers.axes, question.controls),
      names: door.names(card, this.#tables.answers.named, question),
      level: door.level(card, question.level ?? 0),
    };
  }

  #motion(asked: Asked, root: "travelling" | "in_place"): Motion {
    const { names, parents } = this.#card.skeleton;
    const found = this.#table.answer(asked.values, asked.names.who, asked.level);
    const frames = found.roots.length / 3;
    const times = Float64Array.from({ length: frames }, (_, i) => along(i, frames, found));
    const stays = root === "in_place";
    return {
      trust: this.#trust(asked, found),
      times,
      rotations: stays ? placed(found, parents.length) : found.rotations,
      rootPosition: stays ? found.placed_roots : found.roots,
      boneOffsets: found.bones,
      curves: found.curves.length ? found.curves : null,
      curveNames: this.#card.curves?.map(({ name }) => name) ?? [],
      names,
      parents,
      rate: (frames - 1) / found.duration,
      frames,
      units: {},
    };
  }

  #trust({ question, values, names, level }: Asked, { duration, sigma }: Answer): Trust {
    const card = this.#card;
    const supported = this.#table.supported(values);
    const outside = door.warnings(card, values);
    const range = outside.length || supported ? outside : [door.GAP];
    const said = [...(question.extrapolate === "ok" ? [] : range), ...names.left];
    if (question.extrapolate === "refuse" && said.length) throw new door.Refused(said.join("; "));
    const { performer, labels } = names;
    const band = this.#tables.bands.find(([, most]) => most === null || sigma <= most);
    return {
      model: card.identity,
      controls: question.controls,
      performer,
      level,
      duration,
      sigma,
      supported,
      warnings: said,
      ...(Object.keys(labels).length ? { labels } : {}),
      ...(card.performers.length ? { performer_seen: performer !== null } : {}),
      band: band![0],
    } as Trust;
  }
}

/** Refuses what differs from the prediction. */
function predicted({ take, detail, feet }: Pick<ClipQuestion, "take" | "detail" | "feet">): void {
  if (take || detail) throw new door.NeedsService("another take");
  if (feet === "stand") throw new door.NeedsService("feet that stand");
}

function at(clip: Motion, time: number) {
  return sample(posture(clip.names.length), clip, time);
}

function along(frame: number, frames: number, { duration }: Answer): number {
  return (duration * frame) / (frames - 1);
}

/** The joints' rotations with those of a root that stays where it is. */
function placed({ rotations, placed_turns: turns }: Answer, joints: number): Float32Array {
  const out = rotations.slice();
  for (let frame = 0; frame < turns.length / 4; frame++) {
    out.set(turns.subarray(4 * frame, 4 * frame + 4), 4 * joints * frame);
  }
  return out;
}
