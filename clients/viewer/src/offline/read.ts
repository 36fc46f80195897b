/** The data in a copy of the page: service/posefield/answer_table/row_compression.py writes it. */

import type { ModelCard, Trust } from "@posefield/client";

/** Numbers as integers of 16 bits, column by column: all low bytes, then all high ones. */
export interface BlockHead {
  readonly offset: number;
  readonly rows: number;
  readonly columns: number;
  /** Of each column: an integer stands for so much. */
  readonly steps: readonly number[];
}

export interface LevelHead {
  readonly coefficients: BlockHead;
  readonly basis: BlockHead;
  readonly mean: BlockHead;
  /** Duration, s, and sigma, m. */
  readonly trust: BlockHead;
}

/** Differences between interpolated and computed answers: answer_table/accuracy.py. */
export interface Accuracy {
  readonly points: number;
  readonly worst: number;
  readonly beyond: number;
  /** At points of the table. */
  readonly stored: number;
  readonly typical: number;
  /** As a share of a curve's range. */
  readonly curves: number;
  readonly duration: number;
  readonly sigma: number;
  readonly support: number;
}

export interface Tables {
  readonly card: ModelCard;
  /** Largest sigma of each band, m; the last has no end. */
  readonly bands: readonly (readonly [NonNullable<Trust["band"]>, number | null])[];
  readonly accuracy: Accuracy;
  /** Where the character at rest is, as binary glTF. */
  readonly character: { readonly offset: number; readonly size: number };
  readonly answers: {
    /** Label set whose names have rows of their own, after those of no name; others are left open. */
    readonly named: string | null;
    /** Values of each control in the grid. */
    readonly axes: readonly (readonly number[])[];
    /** Name and shape of each array in a row. */
    readonly layout: Readonly<Record<RowPart, readonly number[]>>;
    readonly levels: readonly LevelHead[];
    readonly support_axes: readonly (readonly number[])[];
    readonly support: BlockHead;
    readonly answers: number;
  };
}

export type RowPart = "rotations" | "roots" | "placed_turns" | "placed_roots" | "curves" | "bones";

/** rows × columns numbers of a block. */
export type Numbers = (head: BlockHead) => Float32Array;

export interface Unpacked {
  readonly tables: Tables;
  readonly numbers: Numbers;
  readonly character: () => Uint8Array<ArrayBuffer>;
}

/** packed: gzip in base64. */
export async function unpacked(packed: string): Promise<Unpacked> {
  const bytes = Uint8Array.from(atob(packed), (letter) => letter.charCodeAt(0));
  const plain = new Blob([bytes]).stream().pipeThrough(new DecompressionStream("gzip"));
  const whole = await new Response(plain).arrayBuffer();
  const size = new DataView(whole).getUint32(0, true);
  const tables = JSON.parse(new TextDecoder().decode(new Uint8Array(whole, 4, size))) as Tables;
  const blocks = new Uint8Array(whole, 4 + size);
  return {
    tables,
    numbers: (head) => numbers(blocks, head),
    character: () => {
      const { offset, size } = tables.character;
      return blocks.slice(offset, offset + size);
    },
  };
}

function numbers(blocks: Uint8Array, { offset, rows, columns, steps }: BlockHead): Float32Array {
  const found = new Float32Array(rows * columns);
  const high = offset + rows * columns;
  for (let column = 0; column < columns; column++) {
    for (let row = 0; row < rows; row++) {
      const at = column * rows + row;
      const integer = ((blocks[high + at]! << 24) >> 16) | blocks[offset + at]!;
      found[row * columns + column] = integer * steps[column]!;
    }
  }
  return found;
}
