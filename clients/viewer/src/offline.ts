/** Whether this copy of the page works without a service, on answers computed beforehand. */

import { unpacked } from "./offline/read.ts";
import { Offline } from "./offline/source.ts";
import { Table } from "./offline/table.ts";
import type { Source } from "./page.ts";

/** The source that a copy written by `posefield page` holds; null in a service's page. */
export async function offline(): Promise<Source | null> {
  const mark = document.querySelector("#posefield-copy");
  if (!mark) return null;
  const { tables, numbers, character } = await unpacked(mark.textContent ?? "");
  const source = new Offline(tables, new Table(tables, numbers), character);
  // For the browser's console, and for tests.
  Object.assign(globalThis, { posefieldCopy: source });
  return source;
}
