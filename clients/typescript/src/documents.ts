/** JSON answers, looked at so far that what is read of them is there. */

import { Unexpected } from "./errors.ts";
import { type components, LISTS, REQUIRED } from "./schema.ts";

type Name = keyof typeof REQUIRED;
export type Document<Of extends Name> = components["schemas"][Of];

/** The document in an answer; Unexpected where it lacks a key that the contract promises. */
export function read<Of extends Name>(of: Of, content: Uint8Array): Document<Of> {
  return checked(of, json(content));
}

export function json(content: Uint8Array): unknown {
  return parsed(new TextDecoder().decode(content));
}

/** A document of which all keys are there, and lists are lists. */
export function checked<Of extends Name>(of: Of, value: unknown): Document<Of> {
  const found: Readonly<Record<string, unknown>> = isMap(value) ? value : {};
  const missing = REQUIRED[of].filter((key) => !(key in found));
  if (missing.length) throw new Unexpected(`a ${of} without ${missing.join(", ")}`);
  const lists: readonly string[] = LISTS[of];
  const other = lists.filter((key) => !Array.isArray(found[key]));
  if (other.length) throw new Unexpected(`a ${of} without a list as ${other.join(", ")}`);
  return value as Document<Of>;
}

function isMap(value: unknown): value is Readonly<Record<string, unknown>> {
  return typeof value === "object" && value !== null;
}

/** A text of JSON; Unexpected where it is none. */
export function parsed(text: string): unknown {
  try {
    return JSON.parse(text);
  } catch (fault) {
    throw new Unexpected(`no JSON: ${text.slice(0, 40)}`, { cause: fault });
  }
}
