/** Counts of a binary USD file, before the parser of three.js makes room for as many as they say. */

import { Refusal } from "./motion.ts";

/** Bytes of an entry in the table of contents: name, start and size. */
const ENTRY = 32;
const MOST_SECTIONS = 64;
/** Tokens, fields, paths or specs at most; and how many bytes of text a packed byte may be. */
const MOST_COUNT = 5_000_000;
const MOST_PACKING = 255;
/** Sections that begin with a count. */
const COUNTED = ["TOKENS", "STRINGS", "FIELDS", "FIELDSETS", "PATHS", "SPECS"];

/** Throws a Refusal where sections lie outside the file, or say more than their bytes can hold. */
export function checkUsdc(content: ArrayBuffer): void {
  const view = new DataView(content);
  const table = number(view, 16);
  const count = number(view, table);
  if (count > MOST_SECTIONS) throw damaged(`${count} sections`);
  for (let index = 0; index < count; index++) {
    const at = table + 8 + index * ENTRY;
    if (at + ENTRY > view.byteLength) throw damaged("a table of contents that ends early");
    const bytes = [...new Uint8Array(content, at, 16)];
    const name = String.fromCharCode(...bytes.filter((byte) => byte > 0));
    const [start, size] = [number(view, at + 16), number(view, at + 24)];
    if (start + size > view.byteLength) throw damaged(`the section ${name} beyond its end`);
    if (COUNTED.includes(name)) checkCount(view, name, start, size);
  }
}

function checkCount(view: DataView, name: string, start: number, size: number): void {
  const count = number(view, start);
  if (count > Math.min(MOST_COUNT, MOST_PACKING * 4 * size))
    throw damaged(`${count} items in the section ${name} of ${size} bytes`);
  // Before version 0.4 tokens are not packed.
  const packed = view.getUint8(8) > 0 || view.getUint8(9) >= 4;
  if (name !== "TOKENS" || !packed) return;
  const [text, bytes] = [number(view, start + 8), number(view, start + 16)];
  if (bytes > size || text > MOST_PACKING * bytes || count > text)
    throw damaged(`${count} tokens of ${text} bytes in ${bytes}`);
}

function number(view: DataView, at: number): number {
  if (!(at >= 0 && at + 8 <= view.byteLength)) throw damaged("a place beyond its end");
  return Number(view.getBigUint64(at, true));
}

function damaged(what: string): Refusal {
  return new Refusal(`does not open as USD: found ${what}. The file is damaged or not whole`);
}
