/** Answers that are handed on while they come. */

import type { OnProgress } from "./types.ts";
import { type Begun, pieces } from "./wire.ts";

type Piece = Uint8Array<ArrayBuffer>;

/**
 * The body of an answer. It ends with an error where the answer is cut, or where `check`, which is
 * given the last bytes of it, up to `kept` of them, and how many there were, throws.
 */
export function streamed(
  begun: Begun,
  kept: number,
  check: (end: Uint8Array, bytes: number) => void,
  onProgress?: OnProgress,
): ReadableStream<Piece> {
  const source = pieces(begun, onProgress);
  let end: Uint8Array = new Uint8Array();
  let bytes = 0;
  return new ReadableStream<Piece>({
    async pull(stream) {
      const { done, value } = await source.next();
      if (done) {
        check(end, bytes);
        return stream.close();
      }
      end = last(end, value, kept);
      bytes += value.length;
      stream.enqueue(value);
    },
    async cancel() {
      // A piece that is still waited for would be waited for first.
      begun.patience.leave();
      await source.return();
    },
  });
}

function last(before: Uint8Array, piece: Uint8Array, kept: number): Uint8Array {
  if (piece.length >= kept) return piece.slice(-kept);
  const joined = new Uint8Array(before.length + piece.length);
  joined.set(before);
  joined.set(piece, before.length);
  return joined.slice(-kept);
}
