/** A question for a file as a link, and as text for curl and Python. */

import { Client, type ClipFormat, type ClipQuestion, type WalkQuestion } from "@posefield/client";

/** A question, its model and its service. */
export interface Wanted {
  /** Address of the service, without a slash at its end. */
  readonly base: string;
  readonly model: string;
  readonly format: ClipFormat;
  /** For a clip or, without controls, for a crowd that walks. */
  readonly question: ClipQuestion | WalkQuestion;
}

export function ofCrowd(question: Wanted["question"]): question is WalkQuestion {
  return !("controls" in question);
}

export const fileName = (wanted: Wanted): string =>
  `${ofCrowd(wanted.question) ? "crowd" : wanted.model.replace(/[^A-Za-z0-9_-]/g, "_")}.${wanted.format}`;

export function link({ base, model, format, question }: Wanted): string {
  return new Client(base).url(model, format, question);
}

export function curl(wanted: Wanted): string {
  return `curl --fail --output ${quoted(fileName(wanted))} ${quoted(link(wanted))}`;
}

export function python(wanted: Wanted): string {
  const { base, model, question } = wanted;
  const [name, method] = ofCrowd(question) ? ["crowd", "crowd_walk"] : ["clip", "clip"];
  const lines = Object.entries(question)
    .filter(([, value]) => value !== null && value !== undefined)
    .map(([name, value]) => `        ${name}=${literal(value)},`);
  return [
    "from posefield_client import Client",
    "",
    `with Client(${literal(base)}) as client:`,
    `    ${name} = client.model(${literal(model)}).${method}(`,
    ...lines,
    "    )",
    `    ${name}.save(${literal(fileName(wanted))})`,
    "",
  ].join("\n");
}

/** Quote any text as one word of a POSIX shell. */
function quoted(text: string): string {
  return `'${text.replaceAll("'", "'\\''")}'`;
}

/** Write a value for Python, which reads strings, numbers, lists and objects of JSON. */
function literal(value: unknown): string {
  if (typeof value === "boolean") return value ? "True" : "False";
  return JSON.stringify(value);
}
