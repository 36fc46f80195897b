/** The model card out of a model's own metadata: service/posefield/model_file/model_card.py says what stands there. */

import type { ModelCard } from "@posefield/client";

import { BadModel, metadata } from "./protobuf.ts";

const [PREFIX, FORMAT] = ["posefield.", 2];

/** What older files do not say. */
const USUAL = { roles: {}, sources: [], kriging: null, left_out: [], event: null };

export function card(model: Uint8Array, identity: string): ModelCard {
  const own = [...metadata(model)].filter(([key]) => key.startsWith(PREFIX));
  const plain = Object.fromEntries(
    own.map(([key, text]) => [key.slice(PREFIX.length), JSON.parse(text) as unknown]),
  );
  if (!("format" in plain)) throw new BadModel("no model of posefield: it says nothing of itself");
  // What adapting a model takes is of no use to anybody who asks it.
  const { format, making: _, ...rest } = plain;
  if (format !== FORMAT) throw new BadModel(`model format ${String(format)}, expected ${FORMAT}`);
  return { ...USUAL, ...rest, identity } as unknown as ModelCard;
}
