/** Zip of stored files, as a service writes it: of any number of them, below 4 GiB in all. */

import type { Member } from "./archives.ts";
import { Broken } from "./errors.ts";

/** What stands where a number is too large for its place (APPNOTE 4.4.1.4). */
const MANY = 0xffff;

/** The files of a zip in the order of its directory; Broken where it ends before its end does. */
export function* members(content: Uint8Array<ArrayBuffer>): Generator<Member, void> {
  const view = new DataView(content.buffer, content.byteOffset, content.length);
  try {
    let at = view.getUint32(content.length - 6, true);
    for (let left = countOf(view); left > 0; left--) {
      expectSignature(view, at, 0x02014b50);
      const [name, extra, comment] = [28, 30, 32].map((place) => view.getUint16(at + place, true));
      const path = content.subarray(at + 46, at + 46 + name!);
      yield [new TextDecoder().decode(path), stored(content, view, at)];
      at += 46 + name! + extra! + comment!;
    }
  } catch (fault) {
    if (fault instanceof RangeError) throw new Broken("the zip ended in the middle");
    throw fault;
  }
}

/** How many files there are, as the end says, or of very many the end of a Zip64 before it. */
function countOf(view: DataView): number {
  const end = view.byteLength - 22;
  expectSignature(view, end, 0x06054b50);
  const count = view.getUint16(end + 10, true);
  if (count !== MANY) return count;
  const end64 = Number(view.getBigUint64(end - 20 + 8, true));
  expectSignature(view, end64, 0x06064b50);
  return Number(view.getBigUint64(end64 + 32, true));
}

/** A file's content; `at` is its place in the directory. */
function stored(
  content: Uint8Array<ArrayBuffer>,
  view: DataView,
  at: number,
): Uint8Array<ArrayBuffer> {
  const [size, head] = [view.getUint32(at + 24, true), view.getUint32(at + 42, true)];
  expectSignature(view, head, 0x04034b50);
  const start = head + 30 + view.getUint16(head + 26, true) + view.getUint16(head + 28, true);
  return content.subarray(start, start + size);
}

function expectSignature(view: DataView, at: number, expected: number): void {
  const found = view.getUint32(at, true);
  if (found !== expected) throw new Broken(`the zip has ${found} at ${at}, expected ${expected}`);
}
