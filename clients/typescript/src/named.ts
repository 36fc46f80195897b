/** Facts of a file in the headers of an answer. */

import { parsed } from "./documents.ts";
import type { Missed, Named } from "./types.ts";

/** fallback: name of the file if the service gives none. */
export function named(headers: Headers, fallback: string): Named {
  const number = (name: string) => (headers.has(name) ? Number(headers.get(name)) : null);
  // Lines of one header are joined by commas.
  const lines = (name: string) => parsed(`[${headers.get(name) ?? ""}]`);
  return {
    name: /filename="([^"]+)"/.exec(headers.get("Content-Disposition") ?? "")?.[1] ?? fallback,
    mediaType: headers.get("Content-Type") ?? "",
    model: headers.get("Posefield-Model"),
    sigma: number("Posefield-Sigma"),
    duration: number("Posefield-Duration"),
    supported: headers.has("Posefield-Supported")
      ? headers.get("Posefield-Supported") === "true"
      : null,
    inferred: parsed(headers.get("Posefield-Inferred") ?? "{}") as Record<string, number>,
    missed: lines("Posefield-Missed") as Missed[],
    warnings: lines("Posefield-Warning") as string[],
  };
}
