/** Whether this copy of the page works without a service, and on which model. */

import type { Source } from "./page.ts";

interface Part {
  open(tables: string): Promise<Source>;
}

/**
 * The source that a copy written by `posefield page` names in its head; null in a service's page.
 *
 * The part lies beside the copy and is no part of the page, which a service serves without it.
 */
export async function offline(): Promise<Source | null> {
  const meta = document.querySelector<HTMLMetaElement>('meta[name="posefield-model"]');
  if (!meta) return null;
  const beside = (name: string) => new URL(name, document.baseURI).href;
  const part = (await import(/* @vite-ignore */ beside("offline.js"))) as Part;
  return part.open(beside(meta.content));
}
