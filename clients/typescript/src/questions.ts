/** Questions as requests: a link where the question is short enough for one, else a body. */

import { WrongQuestion } from "./errors.ts";
import { MEDIA_TYPES } from "./schema.ts";
import type { Floor, Target } from "./types.ts";

export interface Request {
  readonly method: "GET" | "POST";
  /** With the query. */
  readonly path: string;
  readonly body: string | null;
  /** Media type of a file; a document's form is checked when it is read. */
  readonly mediaType?: string;
}

type Value = string | number | boolean | readonly string[] | null | undefined;
type Labels = Readonly<Record<string, string | Readonly<Record<string, number>>>>;
type Question = Readonly<Record<string, unknown>>;

/**
 * The request that asks a question at a path. A link may be kept by caches and asked for again by
 * its entity tag; not every proxy takes one of more than `longest` characters.
 */
export function request(path: string, question: object, longest: number): Request {
  const linked = link(path, question);
  return linked.length <= longest ? get(linked) : post(path, question);
}

export function get(path: string): Request {
  return { method: "GET", path, body: null };
}

export function post(path: string, question: object): Request {
  return { method: "POST", path, body: JSON.stringify(question, finite) };
}

/** The same request, whose answer is a file. */
export function asFile(asked: Request, format: keyof typeof MEDIA_TYPES): Request {
  return { ...asked, mediaType: MEDIA_TYPES[format] };
}

/** JSON knows no NaN and no infinity: it would say null, which is another question. */
function finite(name: string, value: unknown): unknown {
  if (typeof value !== "number" || Number.isFinite(value)) return value;
  throw new WrongQuestion(`${name}: found ${value}, expected a finite number`);
}

/** A path with a question as its query, as the contract spells it. */
export function link(path: string, question: object): string {
  const query = new URLSearchParams(pairs(question as Question)).toString();
  return query ? `${path}?${query}` : path;
}

/** The path of something under a model; a name may hold an @ before the hash. */
export function under(model: string, rest: string): string {
  return `/v1/models/${encodeURIComponent(model).replace("%40", "@")}${rest}`;
}

/**
 * Each control is a parameter, lists of times and of targets are `time` and `target` again and
 * again, a place is one text.
 */
function pairs({ controls, times, targets, labels, floor, camera, ...rest }: Question): string[][] {
  return [
    ...spelt((controls ?? {}) as Record<string, Value>),
    ...((times ?? []) as number[]).map((time) => ["time", text("time", time)]),
    ...((targets ?? []) as Target[]).map((target) => ["target", words(target)]),
    ...Object.entries((labels ?? {}) as Labels).map((entry) => ["label", labelled(...entry)]),
    ...(floor == null ? [] : [["floor", ground(floor as Floor | number)]]),
    ...spelt(rest as Record<string, Value>),
    ...(camera ? [["camera", place("camera", camera as number[])]] : []),
  ];
}

/** SET=NAME, or SET=NAME:WEIGHT,NAME:WEIGHT. */
function labelled(name: string, value: Labels[string]): string {
  if (typeof value === "string") return `${name}=${value}`;
  const weights = Object.entries(value).map(([each, weight]) => `${each}:${plain(name, weight)}`);
  return `${name}=${weights.join(",")}`;
}

/** JOINT@MOMENT:X,Y,Z. */
function words({ joint, position, time, at }: Target): string {
  const moment = at ?? (time === undefined ? "" : plain("target", time));
  return `${joint}@${moment}:${place("target", position)}`;
}

/** HEIGHT, or HEIGHT,SLOPE_X,SLOPE_Z. */
function ground(floor: Floor | number): string {
  if (typeof floor === "number") return plain("floor", floor);
  return place("floor", [floor.height, floor.slope_x, floor.slope_z]);
}

function place(name: string, values: readonly number[]): string {
  return values.map((value) => plain(name, value)).join(",");
}

function spelt(values: Readonly<Record<string, Value>>): string[][] {
  const given = Object.entries(values).filter(([, value]) => value !== undefined && value !== null);
  return given.map(([name, value]) => [name, text(name, value)]);
}

/** Names in a list have commas between. */
function text(name: string, value: Value): string {
  return String(finite(name, value));
}

/** A number without an exponent, whose + a query takes for a space. */
function plain(name: string, value: number): string {
  const said = text(name, value);
  return said.includes("e") ? value.toFixed(20) : said;
}
