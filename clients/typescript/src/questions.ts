/** Questions as requests: a link where the question is short enough for one, else a body. */

import { WrongQuestion } from "./errors.ts";
import { MEDIA_TYPES } from "./schema.ts";

export interface Request {
  readonly method: "GET" | "POST";
  /** With the query. */
  readonly path: string;
  readonly body: string | null;
  /** What a file has to come as; a document's form is looked at when it is read. */
  readonly mediaType?: string;
}

type Value = string | number | boolean | null | undefined;
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

/** Each control is a parameter, a list of times is `time` again and again, a place is one text. */
function pairs({ controls, times, camera, ...rest }: Question): string[][] {
  return [
    ...spelt((controls ?? {}) as Record<string, Value>),
    ...((times ?? []) as number[]).map((time) => ["time", text("time", time)]),
    ...spelt(rest as Record<string, Value>),
    ...(camera ? [["camera", (camera as number[]).map(coordinate).join(",")]] : []),
  ];
}

function spelt(values: Readonly<Record<string, Value>>): string[][] {
  const given = Object.entries(values).filter(([, value]) => value !== undefined && value !== null);
  return given.map(([name, value]) => [name, text(name, value)]);
}

function text(name: string, value: Value): string {
  return String(finite(name, value));
}

/** A number without an exponent, which places in a query may not have. */
function coordinate(value: number): string {
  const said = text("camera", value);
  return said.includes("e") ? value.toFixed(20) : said;
}
