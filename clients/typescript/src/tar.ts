/** POSIX tar, as a service writes it: files alone, and pax records of long names. */

import type { Member } from "./archives.ts";
import { Broken } from "./errors.ts";

const BLOCK = 512;

/** Bytes at the end of every tar, all of them zero. */
const END = 2 * BLOCK;

/** The files of a tar in their order; Broken where it ends before its end does. */
export function* members(content: Uint8Array<ArrayBuffer>): Generator<Member, void> {
  let long: string | null = null;
  for (let at = 0; ; ) {
    const head = content.subarray(at, at + BLOCK);
    if (at === content.length - END && isEnd(content.subarray(at))) return;
    const start = at + BLOCK;
    const size = Number.parseInt(field(head, 124, 12), 8);
    at = start + BLOCK * Math.ceil(size / BLOCK);
    // Not so of no size at all either.
    if (!(at <= content.length)) throw new Broken("the tar ended in the middle");
    const body = content.subarray(start, start + size);
    if (field(head, 156, 1) === "x") {
      long = pathOf(body);
    } else {
      yield [long ?? field(head, 0, 100), body];
      long = null;
    }
  }
}

/** Whether some bytes end with those that end a tar. */
export function isEnd(bytes: Uint8Array): boolean {
  return bytes.length >= END && bytes.subarray(-END).every((byte) => byte === 0);
}

function field(head: Uint8Array, start: number, length: number): string {
  const text = new TextDecoder("latin1").decode(head.subarray(start, start + length));
  return text.replace(/\0.*$/s, "");
}

/** The name in a pax record: lines of length, key and value. */
function pathOf(record: Uint8Array): string | null {
  const text = new TextDecoder().decode(record);
  return /^\d+ path=(.*)$/m.exec(text)?.[1] ?? null;
}
