/** The first file of a USDZ package, which is its root layer. */

import { Refusal } from "./motion.ts";

const LOCAL_HEADER = 0x04034b50;
const HEADER_BYTES = 30;

/** USDZ packages hold their files as they are, without compression. */
export async function firstEntry(file: Blob): Promise<{ name: string; content: Blob }> {
  const head = new DataView(await file.slice(0, HEADER_BYTES).arrayBuffer());
  if (head.byteLength < HEADER_BYTES || head.getUint32(0, true) !== LOCAL_HEADER)
    throw new Refusal("found no file in the package, expected a USD layer");
  const [flags, method, size] = [
    head.getUint16(6, true),
    head.getUint16(8, true),
    head.getUint32(18, true),
  ];
  const [named, more] = [head.getUint16(26, true), head.getUint16(28, true)];
  const name = await file.slice(HEADER_BYTES, HEADER_BYTES + named).text();
  if (method !== 0)
    throw new Refusal(`found ${name} compressed, expected it stored, as USDZ has it`);
  if (flags & 8) throw new Refusal(`found ${name} without its size, expected it, as USDZ has it`);
  const begin = HEADER_BYTES + named + more;
  if (begin + size > file.size)
    throw new Refusal(
      `found ${file.size - begin} of ${size} bytes of ${name}: the file is not whole`,
    );
  return { name, content: file.slice(begin, begin + size) };
}
