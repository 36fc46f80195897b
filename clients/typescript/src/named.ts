/** What the head of an answer says of the file in it. */

import { isList, isMap, isTexts, parsed } from "./documents.ts";
import { Unexpected } from "./errors.ts";
import type { Missed, Named } from "./types.ts";

/** fallback: a name for where the service gives none. */
export function named(headers: Headers, fallback: string): Named {
  return {
    name: /filename="([^"]+)"/.exec(headers.get("Content-Disposition") ?? "")?.[1] ?? fallback,
    mediaType: headers.get("Content-Type") ?? "",
    model: headers.get("Posefield-Model"),
    sigma: number(headers.get("Posefield-Sigma")),
    duration: number(headers.get("Posefield-Duration")),
    supported: truth(headers.get("Posefield-Supported")),
    inferred: inferred(headers.get("Posefield-Inferred")),
    missed: missed(headers.get("Posefield-Missed")),
    warnings: warnings(headers.get("Posefield-Warning")),
  };
}

function number(text: string | null): number | null {
  return text === null ? null : Number(text);
}

function truth(text: string | null): boolean | null {
  return text === null ? null : text === "true";
}

function inferred(text: string | null): Readonly<Record<string, number>> {
  const found = parsed(text ?? "{}");
  if (isNumbers(found)) return found;
  throw new Unexpected(`Posefield-Inferred: found ${text}, expected numbers by name`);
}

function isNumbers(value: unknown): value is Readonly<Record<string, number>> {
  if (!isMap(value) || isList(value)) return false;
  return Object.values(value).every((each) => typeof each === "number");
}

/** Each is a JSON object in ASCII; lines of one header are joined by commas. */
function missed(joined: string | null): readonly Missed[] {
  const found = parsed(`[${joined ?? ""}]`);
  if (isList(found) && found.every(isMissed)) return found;
  throw new Unexpected(`Posefield-Missed: found ${joined}, expected what, miss and unit of each`);
}

function isMissed(value: unknown): value is Missed {
  if (!isMap(value)) return false;
  const { what, miss, unit } = value;
  return typeof what === "string" && typeof miss === "number" && typeof unit === "string";
}

/** Each is a JSON string in ASCII; lines of one header are joined by commas. */
function warnings(joined: string | null): readonly string[] {
  const found = parsed(`[${joined ?? ""}]`);
  if (isTexts(found)) return found;
  throw new Unexpected(`Posefield-Warning: found ${joined}, expected texts`);
}
