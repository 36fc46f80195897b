/** JSON answers, looked at so far that what is read of them is there. */

import { Unexpected } from "./errors.ts";
import { type components, REQUIRED } from "./schema.ts";

type Name = keyof typeof REQUIRED;
export type Document<Of extends Name> = components["schemas"][Of];

/** The document in an answer; Unexpected where it lacks a key that the contract promises. */
export function read<Of extends Name>(of: Of, content: Uint8Array): Document<Of> {
  return checked(of, json(content));
}

/** The documents in an answer of JSON Lines. */
export function lines<Of extends Name>(of: Of, content: Uint8Array): Document<Of>[] {
  const text = new TextDecoder().decode(content);
  const found = text.split("\n").filter((line) => line !== "");
  return found.map((line) => checked(of, parsed(line)));
}

export function json(content: Uint8Array): unknown {
  return parsed(new TextDecoder().decode(content));
}

function checked<Of extends Name>(of: Of, value: unknown): Document<Of> {
  const missing = REQUIRED[of].filter((key) => !has(value, key));
  if (missing.length) throw new Unexpected(`a ${of} without ${missing.join(", ")}`);
  return value as Document<Of>;
}

function has(value: unknown, key: string): boolean {
  return typeof value === "object" && value !== null && key in value;
}

/** A text of JSON; Unexpected where it is none. */
export function parsed(text: string): unknown {
  try {
    return JSON.parse(text);
  } catch (fault) {
    throw new Unexpected(`no JSON: ${text.slice(0, 40)}`, { cause: fault });
  }
}
