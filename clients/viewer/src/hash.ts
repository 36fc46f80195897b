/** The state as the address bar's hash: `#reaching?stature=1.72&turn=20&~time=0.5`.
 *
 * Controls by their names; everything else begins with `~` and is written only where it is not as
 * at the start. What cannot be read is named, and the rest holds.
 */

import type { ModelCard } from "@posefield/client";

import { otherSets } from "./examples.ts";
import { LONGEST_SCRIPT, read as readScript } from "./performance/script.ts";
import type { State } from "./state.ts";
import {
  HIGHEST_FLOOR,
  hasDetail,
  LARGEST_SEED,
  standsByDefault,
  VARIETY,
  whyFeetCannotStand,
} from "./takes.ts";
import { read as number } from "./written.ts";

export interface Address {
  /** null where none is named. */
  readonly model: string | null;
  readonly entries: readonly (readonly [string, string])[];
}

type Rest = Omit<State, "model" | "controls">;
type Key = keyof Rest;

/** `undefined` where the text says nothing that is expected. */
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

/** Controls in the order in which they are worth a map: those of few values last. */
function mapped({ controls }: ModelCard): readonly string[] {
  const [few, many] = [true, false].map((is) =>
    controls.filter(({ values }) => values.length > 0 === is),
  );
  return [...many!, ...few!].map(({ name }) => name);
}

/** What a model's page shows where nobody says otherwise. */
export function initial(model: string, card: ModelCard): State {
  const [across = "", along = ""] = mapped(card);
  return {
    model,
    controls: Object.fromEntries(card.controls.map(({ name, default: value }) => [name, value])),
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

export function restored(
  found: Address,
  model: string,
  card: ModelCard,
): { state: State; faults: readonly string[] } {
  const start = initial(model, card);
  const controls: Record<string, number> = { ...start.controls };
  const rest: Partial<Record<Key, unknown>> = {};
  const faults: string[] = [];
  for (const [key, text] of found.entries) {
    const fault = key.startsWith("~")
      ? take(rest, key.slice(1), text, card)
      : steer(controls, key, text);
    if (fault) faults.push(fault);
  }
  return { state: { ...start, ...(rest as Partial<Rest>), controls }, faults };
}

export function written(state: State, card: ModelCard): string {
  const start = initial(state.model, card);
  const controls = Object.entries(state.controls).map(
    ([name, value]) => `${safe(name)}=${rounded(value)}`,
  );
  const rest = (Object.keys(FIELDS) as Key[])
    .map((key) => [key, spelt(state, key)] as const)
    .filter(([key, text]) => text !== spelt(start, key))
    .map(([key, text]) => `~${key}=${safe(text)}`);
  return `#${safe(state.model)}?${[...controls, ...rest].join("&")}`;
}

function spelt(state: State, key: Key): string {
  return (FIELDS[key] as Field<unknown>).write(state[key]);
}

function steer(controls: Record<string, number>, name: string, text: string): string | null {
  if (!Object.hasOwn(controls, name)) return `${name}: this model has no such control`;
  const value = number(text);
  if (typeof value === "string") return `${name}: ${value}`;
  controls[name] = value;
  return null;
}

function take(
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
    expected: (card) => card.performers.join(", ") || "nobody: performers are not told apart",
    read: (text, card) => (card.performers.includes(text) ? text : undefined),
    write: (value) => value ?? "",
  },
  labels: {
    expected: (card) =>
      otherSets(card)
        .map(({ name, names }) => `${name}:${names.join(" or ")}`)
        .join(", ") || "nothing: there are no label sets",
    read: readLabels,
    write: (value) =>
      Object.entries(value)
        .map(([name, label]) => `${name}:${label}`)
        .join(","),
  },
  level: between((card) => [0, card.levels.length - 1], Number.isInteger),
  time: between(() => [0, 3600]),
  playing: yes(),
  speed: between(() => [0.1, 2]),
  loop: yes(),
  root: one("travelling", "in_place"),
  body: one("stick", "mannequin"),
  ghost: yes(),
  fan: yes(),
  feet: yes(),
  stands: possible(whyFeetCannotStand),
  floor: between(() => [-HIGHEST_FLOOR, HIGHEST_FLOOR]),
  take: between(() => [0, LARGEST_SEED], Number.isInteger),
  variety: between(() => [0, 1]),
  detail: possible((card) => (hasDetail(card) ? null : "this model has no details to sample")),
  target: {
    expected: () => "x,y,z in metres",
    read: point,
    write: (value) => (value ?? []).map(rounded).join(","),
  },
  view: one("one", "levels", "crowd", "performance"),
  across: control(),
  along: control(),
  crowd: between(() => [50, 10_000], Number.isInteger),
  varied: yes(),
  pixels: between(() => [0.25, 16]),
  script: {
    expected: () => "the script of a performance as JSON",
    read: (text) => (typeof readScript(text) === "string" ? undefined : text),
    // A longer one is a file: not all that pass links on keep them whole.
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

/** A name for each of some label sets, commas between. */
function readLabels(text: string, card: ModelCard): State["labels"] | undefined {
  const pairs = text.split(",").map((part) => part.split(/:(.*)/s));
  const known = otherSets(card);
  const good = pairs.every(([name, label]) =>
    known.some((own) => own.name === name && own.names.includes(label ?? "")),
  );
  return good ? (Object.fromEntries(pairs) as Record<string, string>) : undefined;
}

/** Three numbers between commas. */
function point(text: string): State["target"] | undefined {
  const found = text.split(",").map(number);
  const [x, y, z] = found;
  const good = found.length === 3 && found.every((value) => typeof value === "number");
  return good ? [x as number, y as number, z as number] : undefined;
}

function yes(): Field<boolean> {
  return {
    expected: () => "yes or no",
    read: (text) => ({ yes: true, no: false })[text],
    write: (value) => (value ? "yes" : "no"),
  };
}

/** lacks: in words, why a model cannot do it; null where it can. */
function possible(lacks: (card: ModelCard) => string | null): Field<boolean> {
  const { expected, read, write } = yes();
  return {
    expected: (card) => (lacks(card) ? `no: ${lacks(card)}` : expected(card)),
    read: (text, card) => (text === "yes" && lacks(card) ? undefined : read(text, card)),
    write,
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

/** Six digits: finer than any slider, and the same text again when read back. */
function rounded(value: number): string {
  return String(Number(value.toPrecision(6)));
}

function safe(text: string): string {
  return encodeURIComponent(text).replaceAll("%40", "@");
}

/** As it stands, where percent signs make no sense. */
function plain(text: string): string {
  try {
    return decodeURIComponent(text);
  } catch {
    return text;
  }
}
