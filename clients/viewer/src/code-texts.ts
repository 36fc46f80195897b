/** A question for a clip as text that others run: a link, curl, Python. */

import { Client, type ClipFormat, type ClipQuestion } from "@posefield/client";

/** What is asked of whom. */
export interface Wanted {
  /** Address of the service, without a slash at its end. */
  readonly base: string;
  readonly model: string;
  readonly format: ClipFormat;
  readonly question: ClipQuestion;
}

/** Parameters of a clip besides its controls, as the contract and the Python client call them. */
type Words = Readonly<Record<string, string | number | boolean | Readonly<Record<string, string>>>>;

export const fileName = ({ model, format }: Wanted): string =>
  `${model.replace(/[^A-Za-z0-9_-]/g, "_")}.${format}`;

export function link({ base, model, format, question }: Wanted): string {
  return new Client(base).url(model, format, question);
}

export function curl(wanted: Wanted): string {
  return `curl --fail --output ${quoted(fileName(wanted))} ${quoted(link(wanted))}`;
}

export function python(wanted: Wanted): string {
  const { base, model, question } = wanted;
  const controls = Object.entries(question.controls);
  const plain = controls.every(([name]) => isKeyword(name));
  const named = plain ? controls.map(([name, value]) => `${name}=${value}`) : [mapping(controls)];
  const rest = Object.entries(words(question)).map(([name, value]) => `${name}=${literal(value)}`);
  const lines = [...named, ...rest].map((line) => `        ${line},`);
  return [
    "from posefield_client import Client",
    "",
    `with Client(${literal(base)}) as client:`,
    `    clip = client.model(${literal(model)}).clip(`,
    ...lines,
    "    )",
    `    clip.save(${literal(fileName(wanted))})`,
    "",
  ].join("\n");
}

/** What is said; nothing and null say nothing. */
function words({ controls: _, ...rest }: ClipQuestion): Words {
  const said = Object.entries(rest).filter(([, value]) => value !== null && value !== undefined);
  return Object.fromEntries(said) as Words;
}

/** As one word of a POSIX shell, whatever is in it. */
function quoted(text: string): string {
  return `'${text.replaceAll("'", "'\\''")}'`;
}

/** As Python reads it: JSON's strings, numbers and objects of them are Python's too. */
function literal(value: Words[string]): string {
  if (typeof value === "boolean") return value ? "True" : "False";
  return JSON.stringify(value);
}

function mapping(controls: readonly (readonly [string, number])[]): string {
  const entries = controls.map(([name, value]) => `${literal(name)}: ${value}`);
  return `controls={${entries.join(", ")}}`;
}

// Words of the language, and parameters that the client's own clip() has.
const TAKEN = new Set(
  (
    "False None True and as assert async await break class continue def del elif else except " +
    "finally for from global if import in is lambda nonlocal not or pass raise return try while " +
    "with yield body controls detail end exact extrapolate feet floor fps joint_sigma labels level loop model " +
    "names performer progress root self start take targets unit up variety"
  ).split(" "),
);

function isKeyword(name: string): boolean {
  return /^[A-Za-z_][A-Za-z0-9_]*$/.test(name) && !TAKEN.has(name);
}
