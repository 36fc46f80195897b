/**
 * ONNX files as protocol buffers: their metadata, and files of parts of their graph.
 *
 * onnxruntime computes all that a session holds, asked for or not, and slices each weight at each
 * run where the level is an input. The service's `model_file/onnx_file.py` does the same.
 */

import { ModelError } from "./errors.ts";

interface Field {
  readonly number: number;
  readonly content: Uint8Array;
  readonly encoded: Uint8Array;
}

const GRAPH = 7;
const METADATA = 14;
const [NODE, INITIALIZER, INPUT, OUTPUT] = [1, 5, 11, 12] as const;
/** Fields of a graph that define names, and the field in each that holds them. */
const NAME_FIELDS: Readonly<Record<number, number>> = {
  [NODE]: 2,
  [INITIALIZER]: 8,
  [INPUT]: 1,
  [OUTPUT]: 1,
};
const NODE_INPUT = 1;
const DECODER = new TextDecoder("utf-8", { fatal: true });

/** Texts of the file's metadata by key. */
export function metadata(model: Uint8Array): Map<string, string> {
  const entries = new Map<string, string>();
  for (const entry of wireFields(model)) {
    if (entry.number !== METADATA) continue;
    const [key = "", value = ""] = [1, 2].map((number) => names(entry.content, number)[0]);
    entries.set(key, value);
  }
  return entries;
}

/** The model with a constant level, these outputs, and the nodes and weights that they need. */
export function selectOutputs(model: Uint8Array, outputs: readonly string[], level: number) {
  const fields = wireFields(model).map((field) =>
    field.number === GRAPH ? encoded(GRAPH, part(field.content, outputs, level)) : field.encoded,
  );
  return joined(fields);
}

function part(graph: Uint8Array, outputs: readonly string[], level: number): Uint8Array {
  const fields = wireFields(graph).filter(({ number, content }) => {
    const defaults = number === INITIALIZER ? ["level", "labels"] : ["level"];
    if (number !== INITIALIZER && number !== INPUT) return true;
    // onnxruntime-web takes no value for an input that has a default.
    return !names(content, NAME_FIELDS[number]!).some((name) => defaults.includes(name));
  });
  const needed = new Set(outputs);
  // Nodes are in topological order: each stands before those that read its outputs.
  for (const { number, content } of fields.toReversed()) {
    if (number !== NODE || !names(content, NAME_FIELDS[NODE]!).some((name) => needed.has(name)))
      continue;
    for (const name of names(content, NODE_INPUT)) needed.add(name);
  }
  const kept = fields.filter(({ number, content }) => {
    const key = NAME_FIELDS[number];
    return key === undefined || names(content, key).some((name) => needed.has(name));
  });
  const present = kept.filter(({ number }) => number === OUTPUT);
  const listed = new Set(present.flatMap(({ content }) => names(content, 1)));
  const added = outputs.filter((name) => !listed.has(name)).map(floatOutput);
  return joined([...kept.map((field) => field.encoded), ...added, levelConstant(level)]);
}

/** An int64 scalar named "level". */
function levelConstant(level: number): Uint8Array {
  const bytes = new Uint8Array(8);
  new DataView(bytes.buffer).setBigInt64(0, BigInt(level), true);
  const tensor = [Uint8Array.of(2 << 3, 7), encoded(8, text("level")), encoded(9, bytes)];
  return encoded(INITIALIZER, joined(tensor));
}

/** Description of an output of float32 numbers of any shape. */
function floatOutput(name: string): Uint8Array {
  const kind = encoded(1, Uint8Array.of(1 << 3, 1));
  return encoded(OUTPUT, joined([encoded(1, text(name)), encoded(2, kind)]));
}

function names(message: Uint8Array, key: number): string[] {
  const fields = wireFields(message).filter(({ number }) => number === key);
  return fields.map(({ content }) => DECODER.decode(content));
}

function wireFields(message: Uint8Array): Field[] {
  const fields: Field[] = [];
  let at = 0;
  function varint(): number {
    for (let value = 0, scale = 1; at < message.length && scale < 2 ** 70; scale *= 128) {
      const byte = message[at++]!;
      value += (byte & 0x7f) * scale;
      if (byte < 0x80) return value;
    }
    throw new ModelError(`a number at byte ${at} does not end`);
  }
  while (at < message.length) {
    const start = at;
    const key = varint();
    const [number, kind] = [Math.floor(key / 8), key % 8];
    let size = 0;
    if (kind === 0) varint();
    else if (kind === 2) size = varint();
    else if (kind === 1 || kind === 5) size = kind === 1 ? 8 : 4;
    else throw new ModelError(`field ${number} has wire type ${kind}: this is no ONNX file`);
    if (number === 0 || at + size > message.length)
      throw new ModelError(`field ${number} of ${size} bytes at byte ${start}: no ONNX file`);
    at += size;
    const content = message.subarray(at - size, at);
    fields.push({ number, content, encoded: message.subarray(start, at) });
  }
  return fields;
}

function encoded(number: number, content: Uint8Array): Uint8Array {
  const size: number[] = [];
  let rest = content.length;
  for (; rest > 0x7f; rest = Math.floor(rest / 128)) size.push((rest % 128) + 128);
  return joined([Uint8Array.of((number << 3) | 2, ...size, rest), content]);
}

function joined(parts: readonly Uint8Array[]): Uint8Array {
  const content = new Uint8Array(parts.reduce((total, { length }) => total + length, 0));
  let at = 0;
  for (const piece of parts) {
    content.set(piece, at);
    at += piece.length;
  }
  return content;
}

function text(characters: string): Uint8Array {
  return new TextEncoder().encode(characters);
}
