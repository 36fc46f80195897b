/**
 * A model file as far as a browser must read it by itself: what it says of itself, and its inputs
 * that have a default, which onnxruntime-web can neither be told of nor be fed.
 *
 * They are protocol buffers: fields of a number, a kind and a content (onnx.proto). The service does
 * the same in service/posefield/model_file/subgraph.py.
 */

import { PosefieldError } from "@posefield/client";

// Numbers of fields in onnx.proto.
const [GRAPH, METADATA, KEY, VALUE] = [7, 14, 1, 2];
const [INITIALIZER, TENSOR_NAME] = [5, 8];
const [VARINT, LENGTH] = [0, 2];
const FIXED: Readonly<Record<number, number>> = { 1: 8, 5: 4 };
const INT64 = 7;

interface Field {
  readonly number: number;
  /** Its bytes as they stand in the file, and what it holds. */
  readonly whole: Uint8Array;
  readonly content: Uint8Array;
}

/** What a file is not that should be a model of posefield. */
export class BadModel extends PosefieldError {
  override readonly name: string = "BadModel";
}

/** What a model says of itself: text by key. */
export function metadata(model: Uint8Array): Map<string, string> {
  const found = new Map<string, string>();
  for (const { number, content } of fields(model)) {
    if (number !== METADATA) continue;
    const entry = [...fields(content)];
    const text = (which: number) =>
      new TextDecoder().decode(entry.find((field) => field.number === which)?.content);
    found.set(text(KEY), text(VALUE));
  }
  return found;
}

/** The same model, whose input `level` is that number and whose performer must be given. */
export function atLevel(model: Uint8Array, level: number): Uint8Array {
  return joined(
    [...fields(model)].map(({ number, whole, content }) =>
      number === GRAPH ? packed(GRAPH, frozen(content, level)) : whole,
    ),
  );
}

const INPUT = 11;
const VALUE_NAME = 1;

function frozen(graph: Uint8Array, level: number): Uint8Array {
  const value = new Uint8Array(8);
  value[0] = level;
  const constant = joined([
    new Uint8Array([(2 << 3) | VARINT, INT64]),
    packed(TENSOR_NAME, new TextEncoder().encode("level")),
    packed(9, value),
  ]);
  const kept = [...fields(graph)].filter((field) => !replaced(field)).map(({ whole }) => whole);
  return joined([...kept, packed(INITIALIZER, constant)]);
}

function replaced({ number, content }: Field): boolean {
  if (number === INPUT) return named(content, VALUE_NAME) === "level";
  if (number !== INITIALIZER) return false;
  return ["level", "performer"].includes(named(content, TENSOR_NAME));
}

function named(content: Uint8Array, which: number): string {
  for (const field of fields(content)) {
    if (field.number === which) return new TextDecoder().decode(field.content);
  }
  return "";
}

function* fields(bytes: Uint8Array): Generator<Field> {
  let at = 0;
  while (at < bytes.length) {
    const start = at;
    let [key, next] = varint(bytes, at);
    let content = bytes.subarray(0, 0);
    if ((key & 7) === LENGTH) {
      const [size, from] = varint(bytes, next);
      next = from + size;
      content = bytes.subarray(from, next);
    } else {
      next = (key & 7) === VARINT ? varint(bytes, next)[1] : next + (FIXED[key & 7] ?? Number.NaN);
    }
    // NaN is no place either.
    if (!(next <= bytes.length)) throw new BadModel("no protocol buffer, expected a model file");
    yield { number: key >>> 3, whole: bytes.subarray(start, next), content };
    at = next;
    key = 0;
  }
}

/** A whole number of seven bits a byte, the lowest first, and where the next thing stands. */
function varint(bytes: Uint8Array, from: number): [number, number] {
  let [value, scale, at] = [0, 1, from];
  for (;;) {
    const byte = bytes[at++];
    if (byte === undefined) throw new BadModel("a model file that ends in the middle");
    value += (byte & 127) * scale;
    scale *= 128;
    if (byte < 128) return [value, at];
  }
}

function packed(number: number, content: Uint8Array): Uint8Array {
  return joined([spelt((number << 3) | LENGTH), spelt(content.length), content]);
}

function spelt(value: number): Uint8Array {
  const groups: number[] = [];
  let left = value;
  while (left > 127) {
    groups.push((left % 128) | 128);
    left = Math.floor(left / 128);
  }
  return new Uint8Array([...groups, left]);
}

function joined(parts: readonly Uint8Array[]): Uint8Array {
  const whole = new Uint8Array(parts.reduce((sum, part) => sum + part.length, 0));
  let at = 0;
  for (const part of parts) {
    whole.set(part, at);
    at += part.length;
  }
  return whole;
}
