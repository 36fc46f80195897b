/** BVH: the skeleton, and the motion read in slices, so that memory does not depend on its size. */

import { snappedRate } from "./frame-rate.ts";
import {
  figured,
  MOST_JOINTS,
  type Motion,
  pickedFrames,
  placed,
  product,
  Refusal,
  type Turn,
} from "./motion.ts";
import { general } from "./numbers.ts";

/** Bytes of a skeleton at most, and bytes of the motion a time. */
const SKELETON_BYTES = 2_000_000;
const SLICE = 4_000_000;
const TOKEN = /[{}]|[^\s{}]+|\n/g;
const CHANNEL = /^([XYZ])(position|rotation)$/i;
const SOME_NUMBER = /^[+-]?(\d+\.?\d*|\.\d+)(e[+-]?\d+)?$/i;

interface Joint {
  readonly name: string;
  readonly parent: number;
  readonly offset: number[];
  readonly channels: string[];
}

export async function readBvh(file: Blob): Promise<Motion> {
  const head = latin(await file.slice(0, SKELETON_BYTES).arrayBuffer());
  const motion = /^[ \t]*MOTION[ \t]*\r?$/im.exec(head);
  const joints = hierarchy(motion ? head.slice(0, motion.index) : head);
  if (!motion)
    throw new Refusal(
      "found no line MOTION after the skeleton: a skeleton without motion, or a file that is not whole",
    );
  const stated = timing(head, motion.index + motion[0].length);
  const columns = joints.reduce((sum, { channels }) => sum + channels.length, 0);
  const rows = await numbers(file, stated.end, stated.frames, columns);
  const parents = joints.map(({ parent }) => parent);
  const fps = snappedRate(stated.seconds);
  return {
    format: "BVH",
    names: joints.map(({ name }) => name),
    parents,
    takes: [{ name: "", frames: stated.frames, fps, fault: null }],
    rateSaid: `frame time ${general(stated.seconds, 6)} s`,
    ...figured(
      parents,
      rows.map((row) => posed(joints, row)),
    ),
    rest: placed(parents, atRest(joints)),
    metresPerUnit: null,
    up: null,
    meshes: null,
    warnings: stated.frames > 1 ? [] : ["found 1 frame, a pose without motion"],
    notes: [],
  };
}

function latin(content: ArrayBuffer): string {
  return new TextDecoder("latin1").decode(content);
}

/** Its joints, parents first; it does not recurse, so that deep nesting overflows no stack. */
function hierarchy(text: string): Joint[] {
  const found: Joint[] = [];
  const open: number[] = [];
  const cursor = new Cursor(text);
  cursor.expect("HIERARCHY");
  cursor.expect("ROOT");
  begin(cursor, found, open);
  while (open.length) {
    const word = cursor.take();
    const joint = found[open.at(-1)!]!;
    if (word === "}") {
      if (joint.offset.length !== 3)
        throw cursor.fault(
          `found ${joint.offset.length / 3} OFFSETs of joint '${joint.name}', expected one`,
        );
      open.pop();
    } else if (/^offset$/i.test(word)) joint.offset.push(...cursor.vector());
    else if (/^channels$/i.test(word)) joint.channels.push(...cursor.channels());
    else if (/^joint$/i.test(word)) begin(cursor, found, open);
    else if (/^end$/i.test(word)) endSite(cursor);
    else
      throw cursor.unexpected(
        word,
        `OFFSET, CHANNELS, JOINT, End Site or '}' in joint '${joint.name}'`,
      );
  }
  const word = cursor.take();
  if (/^root$/i.test(word)) throw cursor.fault("one root expected, found a second");
  if (word) throw cursor.unexpected(word, "a line MOTION after the root's closing brace");
  return found;
}

function begin(cursor: Cursor, found: Joint[], open: number[]): void {
  const name = cursor.name();
  if (found.some((joint) => joint.name === name))
    throw cursor.fault(
      `joint name '${name}' stands twice, expected every joint to have its own name`,
    );
  found.push({ name, parent: open.at(-1) ?? -1, offset: [], channels: [] });
  open.push(found.length - 1);
  if (found.length > MOST_JOINTS)
    throw cursor.fault(`found ${found.length} joints, expected at most ${MOST_JOINTS}`);
  cursor.expect("{");
}

function endSite(cursor: Cursor): void {
  for (const word of ["Site", "{", "OFFSET"]) cursor.expect(word);
  cursor.vector();
  cursor.expect("}");
}

/** Words of a skeleton, with the line of each. */
class Cursor {
  readonly #tokens: readonly string[];
  #at = 0;
  #line = 1;

  constructor(text: string) {
    this.#tokens = text.match(TOKEN) ?? [];
  }

  take(): string {
    for (; this.#tokens[this.#at] === "\n"; this.#at++) this.#line++;
    return this.#tokens[this.#at++] ?? "";
  }

  /** The words up to the end of the line or a brace. */
  name(): string {
    const found: string[] = [];
    for (let word = this.#tokens[this.#at]; word && !"\n{}".includes(word); ) {
      found.push(word);
      word = this.#tokens[++this.#at];
    }
    if (!found.length) throw this.fault("found no name, expected a joint's name on this line");
    return found.join(" ");
  }

  expect(keyword: string): void {
    const word = this.take();
    if (word.toUpperCase() !== keyword.toUpperCase()) throw this.unexpected(word, keyword);
  }

  vector(): number[] {
    return [0, 0, 0].map(() => this.#number());
  }

  channels(): string[] {
    const count = this.#number();
    const found: string[] = [];
    while (found.length < count) {
      const word = this.take();
      const parts = CHANNEL.exec(word);
      if (!parts) throw this.unexpected(word, `a channel, ${found.length} of ${count} were found`);
      found.push(parts[1]!.toUpperCase() + parts[2]!.toLowerCase());
    }
    return found;
  }

  unexpected(word: string, wanted: string): Refusal {
    return this.fault(
      `found ${word ? `'${word.slice(0, 60)}'` : "the end of the file"}, expected ${wanted}`,
    );
  }

  fault(message: string): Refusal {
    return new Refusal(`line ${this.#line}: ${message}`);
  }

  #number(): number {
    const word = this.take();
    if (!SOME_NUMBER.test(word)) throw this.unexpected(word, "a number");
    return Number(word);
  }
}

/** Frames, seconds of one, and the place where their numbers begin. */
function timing(head: string, from: number): { frames: number; seconds: number; end: number } {
  const lines = /\s*Frames\s*:\s*(\d{1,18})\s*\n\s*Frame\s+Time\s*:\s*(\S+)[ \t]*(\r?\n|$)/iy;
  lines.lastIndex = from;
  const found = lines.exec(head);
  const seconds = Number(found?.[2]);
  if (!found || Number(found[1]) < 1 || !(seconds >= 1e-6 && seconds <= 1e6)) {
    const said =
      head
        .slice(from, from + 60)
        .trim()
        .split(/\r?\n/)[0] ?? "";
    throw new Refusal(
      `found '${said}' after MOTION, expected 'Frames: N' of at least 1 and 'Frame Time: seconds'`,
    );
  }
  return { frames: Number(found[1]), seconds, end: lines.lastIndex };
}

/** The rows that are measured; all numbers are read and counted. */
async function numbers(
  file: Blob,
  from: number,
  frames: number,
  columns: number,
): Promise<Float64Array[]> {
  const rows = new Map(pickedFrames(frames).map((frame) => [frame, new Float64Array(columns)]));
  let count = 0;
  let left = "";
  for (let at = from; at < file.size; at += SLICE) {
    const text = left + latin(await file.slice(at, at + SLICE).arrayBuffer());
    const last = at + SLICE >= file.size;
    const end = last
      ? text.length
      : Math.max(...[" ", "\n", "\t"].map((blank) => text.lastIndexOf(blank))) + 1;
    left = text.slice(end);
    for (const word of text.slice(0, end).split(/\s+/)) {
      if (!word) continue;
      const value = Number(word);
      if (!SOME_NUMBER.test(word) || !Number.isFinite(value))
        throw new Refusal(
          `found '${word.slice(0, 60)}' in frame ${Math.floor(count / columns) + 1}, expected a number`,
        );
      const row = rows.get(Math.floor(count / columns));
      if (row) row[count % columns] = value;
      count++;
    }
  }
  if (count !== frames * columns)
    throw new Refusal(
      `found ${count} numbers, expected ${frames} frames x ${columns} channels = ${frames * columns}: the file is not whole`,
    );
  return [...rows.values()];
}

function atRest(joints: readonly Joint[]) {
  return {
    places: Float64Array.from(joints.flatMap(({ offset }) => offset)),
    turns: Float64Array.from(joints.flatMap(() => [0, 0, 0, 1])),
  };
}

/** A position channel replaces its part of the OFFSET; rotations are multiplied as they stand. */
function posed(joints: readonly Joint[], row: Float64Array) {
  const { places, turns } = atRest(joints);
  let column = 0;
  joints.forEach(({ channels }, joint) => {
    let turn: Turn = [0, 0, 0, 1];
    for (const channel of channels) {
      const axis = "XYZ".indexOf(channel[0]!);
      const value = row[column++]!;
      if (channel.endsWith("position")) places[3 * joint + axis] = value;
      else turn = product(turn, about(axis, value));
    }
    turns.set(turn, 4 * joint);
  });
  return { places, turns };
}

function about(axis: number, degrees: number): Turn {
  const half = (degrees * Math.PI) / 360;
  const found: Turn = [0, 0, 0, Math.cos(half)];
  found[axis] = Math.sin(half);
  return found;
}
