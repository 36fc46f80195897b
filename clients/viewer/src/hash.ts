/** The state as the address bar's hash: `#cmu_walk?speed=1.3&turn=~20&~time=0.5`.
 *
 * Controls go by their names, with `~` before a value that was inferred; other entries begin with `~` and are written where they differ from the
 * start. Entries that cannot be read are reported, and the others are used.
 */

import type { ModelCard } from "@posefield/client";

import { otherSets } from "./examples.ts";
import { LONGEST_SCRIPT, read as readScript } from "./performance/script.ts";
import {
  HIGHEST_FLOOR,
  hasDetail,
  LARGEST_SEED,
  standsByDefault,
  VARIETY,
  whyFeetCannotStand,
} from "./questions.ts";
import { type State, type Store, valuesOf } from "./state.ts";
import { read as number } from "./written.ts";

export interface Address {
  /** null for an address without a model. */
  readonly model: string | null;
  readonly entries: readonly (readonly [string, string])[];
}

type Rest = Omit<State, "model" | "controls" | "inferred">;
type Key = keyof Rest;

/** An entry; `read` returns undefined for a text that is not as expected. */
interface Field<Value> {
  readonly expected: (card: ModelCard) => string;
  readonly read: (text: string, card: ModelCard) => Value | undefined;
  readonly write: (value: Value) => string;
}

export function address(hash: string): Address {
  const [model = "", rest = ""] = hash.replace(/^#/, "").split(/\?(.*)/s);
  const entries = rest
    .split("&")
    .filter(Boolean)
    .map((entry) => {
      const [key = "", value = ""] = entry.split(/=(.*)/s);
      return [plain(key), plain(value)] as const;
    });
  return { model: plain(model) || null, entries };
}

/** Return the state of a model's page at the start. */
export function initial(model: string, card: ModelCard): State {
  // Controls of few values make poor maps.
  const few = ({ values }: ModelCard["controls"][number]) => Number(values.length > 0);
  const axes = card.controls.toSorted((a, b) => few(a) - few(b)).map(({ name }) => name);
  const [across = "", along = ""] = axes;
  return {
    model,
    controls: {},
    inferred: Object.fromEntries(card.controls.map(({ name, default: value }) => [name, value])),
    performer: null,
    labels: {},
    level: 0,
    time: 0,
    playing: true,
    speed: 1,
    loop: true,
    root: card.root,
    body: "mannequin",
    ghost: false,
    fan: false,
    feet: false,
    stands: standsByDefault(card),
    floor: 0,
    take: 0,
    variety: VARIETY,
    detail: false,
    target: null,
    view: "one",
    across,
    along,
    crowd: 300,
    varied: false,
    pixels: 4,
    script: "",
  };
}

/** Return the state of an address, and a sentence for each entry that cannot be read. */
export function restored(
  { entries }: Address,
  model: string,
  card: ModelCard,
): { state: State; faults: readonly string[] } {
  const start = initial(model, card);
  const controls: Record<string, number> = {};
  const inferred: Record<string, number> = { ...start.inferred };
  const rest: Partial<Record<Key, unknown>> = {};
  const faults: string[] = [];
  for (const [key, text] of entries) {
    const fault = key.startsWith("~")
      ? readEntry(rest, key.slice(1), text, card)
      : readControl(controls, inferred, key, text);
    if (fault) faults.push(fault);
  }
  return { state: { ...start, ...(rest as Partial<Rest>), controls, inferred }, faults };
}

export function written(state: State, card: ModelCard): string {
  const start = initial(state.model, card);
  const controls = Object.entries(valuesOf(state)).map(([name, value]) => {
    const sign = Object.hasOwn(state.controls, name) ? "" : "~";
    return `${safe(name)}=${sign}${rounded(value)}`;
  });
  const rest = (Object.keys(FIELDS) as Key[])
    .map((key) => [key, entryOf(state, key)] as const)
    .filter(([key, text]) => text !== entryOf(start, key))
    .map(([key, text]) => `~${key}=${safe(text)}`);
  return `#${safe(state.model)}?${[...controls, ...rest].join("&")}`;
}

function entryOf(state: State, key: Key): string {
  return (FIELDS[key] as Field<unknown>).write(state[key]);
}

function readControl(
  controls: Record<string, number>,
  inferred: Record<string, number>,
  name: string,
  text: string,
): string | null {
  if (!Object.hasOwn(inferred, name)) return `${name}: this model has no such control`;
  const value = number(text.replace(/^~/, ""));
  if (typeof value === "string") return `${name}: ${value}`;
  (text.startsWith("~") ? inferred : controls)[name] = value;
  return null;
}

function readEntry(
  rest: Partial<Record<Key, unknown>>,
  key: string,
  text: string,
  card: ModelCard,
): string | null {
  if (!Object.hasOwn(FIELDS, key)) return `~${key}: unknown`;
  const field = FIELDS[key as Key] as Field<unknown>;
  const value = field.read(text, card);
  if (value === undefined) return `~${key}: “${text}”, expected ${field.expected(card)}`;
  rest[key as Key] = value;
  return null;
}

const FIELDS: { readonly [K in Key]: Field<State[K]> } = {
  performer: {
    expected: (card) => card.performers.join(", ") || "none: this model has no performers",
    read: (text, card) => (card.performers.includes(text) ? text : undefined),
    write: (value) => value ?? "",
  },
  labels: {
    expected: (card) =>
      otherSets(card)
        .map(({ name, names }) => `${name}:${names.join(" or ")}`)
        .join(", ") || "none: this model has no label sets",
    read: readLabels,
    write: (value) =>
      Object.entries(value)
        .map(([name, label]) => `${name}:${label}`)
        .join(","),
  },
  level: between((card) => [0, card.levels.length - 1], Number.isInteger),
  time: between(() => [0, 3600]),
  playing: flag(),
  speed: between(() => [0.1, 2]),
  loop: flag(),
  root: one("travelling", "in_place"),
  body: one("stick", "mannequin"),
  ghost: flag(),
  fan: flag(),
  feet: flag(),
  stands: flag(whyFeetCannotStand),
  floor: between(() => [-HIGHEST_FLOOR, HIGHEST_FLOOR]),
  take: between(() => [0, LARGEST_SEED], Number.isInteger),
  variety: between(() => [0, 1]),
  detail: flag((card) => (hasDetail(card) ? null : "this model has no details to sample")),
  target: {
    expected: () => "x,y,z in metres",
    read: point,
    write: (value) => (value ?? []).map(rounded).join(","),
  },
  view: one("one", "levels", "crowd", "performance"),
  across: control(),
  along: control(),
  crowd: between(() => [50, 10_000], Number.isInteger),
  varied: flag(),
  pixels: between(() => [0.25, 16]),
  script: {
    expected: () => "the script of a performance as JSON",
    read: (text) => (typeof readScript(text) === "string" ? undefined : text),
    // Longer links are cut by some programs that pass them on.
    write: (value) => (value.length > LONGEST_SCRIPT ? "" : value),
  },
};

function between(
  range: (card: ModelCard) => readonly [number, number],
  fits: (value: number) => boolean = () => true,
): Field<number> {
  return {
    expected: (card) => range(card).join(" to "),
    read: (text, card) => {
      const value = number(text);
      const [least, most] = range(card);
      const good = typeof value === "number" && value >= least && value <= most && fits(value);
      return good ? value : undefined;
    },
    write: rounded,
  };
}

/** Read `set:name` pairs between commas. */
function readLabels(text: string, card: ModelCard): State["labels"] | undefined {
  const pairs = text.split(",").map((part) => part.split(/:(.*)/s));
  const known = otherSets(card);
  const good = pairs.every(([name, label]) =>
    known.some((set) => set.name === name && set.names.includes(label ?? "")),
  );
  return good ? (Object.fromEntries(pairs) as Record<string, string>) : undefined;
}

/** Read three numbers between commas. */
function point(text: string): State["target"] | undefined {
  const numbers = text.split(",").map(number);
  const [x, y, z] = numbers;
  const good = numbers.length === 3 && numbers.every((value) => typeof value === "number");
  return good ? [x as number, y as number, z as number] : undefined;
}

/** why: says why a model cannot do it; null where it can. */
function flag(why: (card: ModelCard) => string | null = () => null): Field<boolean> {
  return {
    expected: (card) => (why(card) ? `no: ${why(card)}` : "yes or no"),
    read: (text, card) =>
      text === "yes" && why(card) ? undefined : { yes: true, no: false }[text],
    write: (value) => (value ? "yes" : "no"),
  };
}

function one<Word extends string>(...words: readonly Word[]): Field<Word> {
  return {
    expected: () => words.join(" or "),
    read: (text) => words.find((word) => word === text),
    write: (value) => value,
  };
}

function control(): Field<string> {
  const names = (card: ModelCard) => card.controls.map(({ name }) => name);
  return {
    expected: (card) => names(card).join(", "),
    read: (text, card) => (names(card).includes(text) ? text : undefined),
    write: (value) => value,
  };
}

/** Write six digits: finer than any slider, and the same text again when read back. */
function rounded(value: number): string {
  return String(Number(value.toPrecision(6)));
}

function safe(text: string): string {
  return encodeURIComponent(text).replaceAll("%40", "@");
}

/** Decode percent signs; a text in which they make no sense stays as it is. */
function plain(text: string): string {
  try {
    return decodeURIComponent(text);
  } catch {
    return text;
  }
}

/** Milliseconds without a change until the address is written. */
const REST = 350;

/** Write each change of the state into the address; those of time and of inferred controls make no step of the history. */
export function follow(store: Store, card: ModelCard, signal: AbortSignal): void {
  let timer: ReturnType<typeof setTimeout> | undefined;
  let lasting = false;
  const write = () => {
    // A time that passes is not worth keeping.
    const { state } = store;
    const text = written(state.playing ? { ...state, time: 0 } : state, card);
    if (text !== location.hash) {
      if (lasting) history.pushState(null, "", text);
      else history.replaceState(null, "", text);
    }
    lasting = false;
  };
  store.listen((state, changed) => {
    if (changed.size === 1 && changed.has("time") && state.playing) return;
    lasting ||= [...changed].some((key) => !["time", "playing", "inferred"].includes(key));
    clearTimeout(timer);
    timer = setTimeout(write, REST);
  }, signal);
  write();
  signal.addEventListener("abort", () => clearTimeout(timer));
}
