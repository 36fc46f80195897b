/** The script of a performance: what a service is sent, and how the page changes it. */

/** Characters of a script that still goes into a link. */
export const LONGEST_SCRIPT = 20_000;

/** On the floor: x to the left and z forward, m. */
export type FloorPoint = readonly [number, number];
export type Point = readonly [number, number, number];
/** Values at distances, m, or times, s. */
export type Curve = readonly (readonly [number, number])[];

export interface Join {
  readonly seconds?: number;
  readonly blend?: "auto" | "dead" | "hermite" | "cut";
  readonly cut?: "best" | "end";
  readonly most?: number;
}

export interface Target {
  readonly joint: string;
  readonly position: Point;
  readonly at?: "start" | "event" | "end";
  readonly time?: number;
  readonly frame?: "world" | "segment";
}

interface Moving {
  readonly model: string;
  readonly performer?: string;
  readonly controls?: Readonly<Record<string, number>>;
  readonly join?: Join;
}

export interface Walk extends Moving {
  readonly kind: "walk";
  readonly along?: readonly FloorPoint[];
  readonly to?: FloorPoint;
  readonly seconds?: number;
  readonly speed?: number | Curve;
  readonly turn?: number | Curve;
  readonly start?: "rolling" | "standing";
  readonly stop?: "rolling" | "standing";
}

export interface Act extends Moving {
  readonly kind: "act";
  readonly targets?: readonly Target[];
  readonly at?: FloorPoint;
  readonly facing?: number;
}

export interface Hold {
  readonly kind: "hold";
  readonly seconds: number;
  readonly joint?: string;
  readonly look_at?: Point;
}

export type Segment = Walk | Act | Hold;
export type Kind = Segment["kind"];

export interface Script {
  readonly segments: readonly Segment[];
  readonly start?: { readonly position?: FloorPoint; readonly heading?: number };
  readonly obstacles?: readonly { readonly position: FloorPoint; readonly radius: number }[];
  readonly fps?: number;
  readonly take?: number;
  readonly feet?: "stand" | "as_predicted";
}

const KINDS: ReadonlySet<unknown> = new Set(["walk", "act", "hold"]);

/** A script as far as the page has to know it, or in words why it is none; a service judges the rest. */
export function read(text: string): Script | string {
  let found: unknown;
  try {
    found = JSON.parse(text);
  } catch (fault) {
    return `This is not JSON: ${(fault as Error).message}.`;
  }
  const segments = isObject(found) ? found["segments"] : undefined;
  if (!Array.isArray(segments) || !segments.length)
    return 'A script is an object with "segments", a list of one segment or more.';
  const wrong = segments.findIndex((each) => !isObject(each) || !KINDS.has(each["kind"]));
  if (wrong >= 0) return `/segments/${wrong}: expected an object with "kind": walk, act or hold.`;
  return found as Script;
}

/** As it is sent and linked. */
export function compact(script: Script): string {
  return JSON.stringify(script);
}

/** As people read it: a line for each segment and each other field. */
export function pretty(script: Script): string {
  const fields = Object.entries(script).map(([name, value]) => {
    const list = name === "segments" && Array.isArray(value);
    const text = list
      ? `[\n${value.map((each) => `    ${spaced(each)}`).join(",\n")}\n  ]`
      : spaced(value);
    return `  ${JSON.stringify(name)}: ${text}`;
  });
  return `{\n${fields.join(",\n")}\n}\n`;
}

function spaced(value: unknown): string {
  if (Array.isArray(value)) return `[${value.map(spaced).join(", ")}]`;
  if (!isObject(value)) return JSON.stringify(value);
  const fields = Object.entries(value).map(
    ([name, each]) => `${JSON.stringify(name)}: ${spaced(each)}`,
  );
  return `{${fields.join(", ")}}`;
}

/** The same with one field set; `undefined` takes it away, and so does an empty object or list. */
export function put<Whole extends object>(whole: Whole, name: string, value: unknown): Whole {
  const rest = Object.entries(whole).filter(([key]) => key !== name);
  if (isNothing(value)) return Object.fromEntries(rest) as Whole;
  return name in whole
    ? ({ ...whole, [name]: value } as Whole)
    : (Object.fromEntries([...rest, [name, value]]) as Whole);
}

export function replaced(script: Script, index: number, segment: Segment): Script {
  return { ...script, segments: script.segments.with(index, segment) };
}

/** After that segment. */
export function added(script: Script, index: number, segment: Segment): Script {
  return { ...script, segments: script.segments.toSpliced(index + 1, 0, segment) };
}

export function removed(script: Script, index: number): Script {
  return { ...script, segments: script.segments.toSpliced(index, 1) };
}

/** Two neighbours in the other order; the same where there is no neighbour. */
export function moved(script: Script, index: number, by: -1 | 1): Script {
  const other = index + by;
  const { segments } = script;
  const [one, two] = [segments[index], segments[other]];
  if (!one || !two) return script;
  return { ...script, segments: segments.with(index, two).with(other, one) };
}

/** Points of a walk that the floor shows and changes. */
export function points(segment: Segment | undefined): readonly FloorPoint[] {
  if (segment?.kind !== "walk") return [];
  if (isPoint(segment.to)) return [segment.to];
  return Array.isArray(segment.along) ? segment.along.filter(isPoint) : [];
}

/** The walk through these points; straight to the only one where it was to walk to a point. */
export function through(walk: Walk, path: readonly FloorPoint[]): Walk {
  const [only] = path;
  if (walk.to && only && path.length === 1) return put(walk, "to", only);
  const free = put(put(put(walk, "to", undefined), "seconds", undefined), "turn", undefined);
  return put(free, "along", path);
}

export function isPoint(value: unknown): value is FloorPoint {
  return Array.isArray(value) && value.length === 2 && value.every(Number.isFinite);
}

function isObject(value: unknown): value is Record<string, unknown> {
  return typeof value === "object" && value !== null && !Array.isArray(value);
}

function isNothing(value: unknown): boolean {
  if (value === undefined || value === null) return true;
  return typeof value === "object" && Object.keys(value).length === 0;
}
