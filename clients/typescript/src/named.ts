/** What the head of an answer says of the file in it. */

import { isTexts, parsed } from "./documents.ts";
import { Unexpected } from "./errors.ts";
import type { Named } from "./types.ts";

/** fallback: a name for where the service gives none. */
export function named(headers: Headers, fallback: string): Named {
  return {
    name: /filename="([^"]+)"/.exec(headers.get("Content-Disposition") ?? "")?.[1] ?? fallback,
    mediaType: headers.get("Content-Type") ?? "",
    model: headers.get("Posefield-Model"),
    sigma: number(headers.get("Posefield-Sigma")),
    duration: number(headers.get("Posefield-Duration")),
    supported: truth(headers.get("Posefield-Supported")),
    warnings: warnings(headers.get("Posefield-Warning")),
  };
}

function number(text: string | null): number | null {
  return text === null ? null : Number(text);
}

function truth(text: string | null): boolean | null {
  return text === null ? null : text === "true";
}

/** Each is a JSON string in ASCII; lines of one header are joined by commas. */
function warnings(joined: string | null): readonly string[] {
  const found = parsed(`[${joined ?? ""}]`);
  if (isTexts(found)) return found;
  throw new Unexpected(`Posefield-Warning: found ${joined}, expected texts`);
}
