/** Questions as requests: a link where the question is short enough for one, else a body. */

export interface Request {
  readonly method: "GET" | "POST";
  /** With the query. */
  readonly path: string;
  readonly body: string | null;
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
  return { method: "POST", path, body: JSON.stringify(question) };
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
    ...((times ?? []) as number[]).map((time) => ["time", String(time)]),
    ...spelt(rest as Record<string, Value>),
    ...(camera ? [["camera", (camera as number[]).map(plain).join(",")]] : []),
  ];
}

function spelt(values: Readonly<Record<string, Value>>): string[][] {
  const given = Object.entries(values).filter(([, value]) => value !== undefined && value !== null);
  return given.map(([name, value]) => [name, String(value)]);
}

/** A number without an exponent, which places in a query may not have. */
function plain(value: number): string {
  const text = String(value);
  return text.includes("e") ? value.toFixed(20) : text;
}
