/** Archives of many clips: tar and zip of stored files, whose last file is a manifest of the others. */

import { lines } from "./documents.ts";
import { Broken } from "./errors.ts";
import { isEnd, members as tarMembers } from "./tar.ts";
import type { Archive, ArchiveFormat, Download, ManifestEntry } from "./types.ts";
import { members as zipMembers } from "./zip.ts";

export type Member = readonly [path: string, content: Uint8Array<ArrayBuffer>];

/** So many bytes at the end of an archive say whether it is whole. */
export const END = 1024;

const MANIFEST = "manifest.jsonl";
const MEMBERS = { zip: zipMembers, tar: tarMembers };

/** The files of an archive that was asked for so many clips; Broken where not all are there. */
export function opened(download: Download, format: ArchiveFormat, clips: number): Archive {
  const members = [...MEMBERS[format](download.content)];
  const [name, manifest] = members.pop() ?? [];
  if (name !== MANIFEST || !manifest) {
    throw new Broken(`the archive ends with ${name ?? "nothing"}, expected ${MANIFEST}`);
  }
  const files = new Map(members);
  const entries = lines("ManifestEntry", manifest);
  if (entries.length !== clips) {
    throw new Broken(`the archive holds ${entries.length} clips, expected ${clips}`);
  }
  for (const entry of entries) expectFile(files, entry);
  const named = new Set(entries.map(({ file }) => file));
  // Once each: of two files of one name, or two entries, one would be lost.
  if (named.size !== entries.length || members.length !== entries.length) {
    throw new Broken(`the archive holds ${members.length} files, its manifest names ${named.size}`);
  }
  return { ...download, entries, files };
}

/** Throws Broken where an archive of so many bytes does not end as a whole one. */
export function expectEnd(format: ArchiveFormat, end: Uint8Array, bytes: number): void {
  if (!ENDS[format](end, bytes)) throw new Broken(`the ${format} ended after ${bytes} bytes`);
}

const ENDS = {
  // The record of the end has 22 bytes, and a service's no comment.
  zip: (end: Uint8Array) => String.fromCharCode(...end.slice(-22, -18)) === "PK\x05\x06",
  tar: (end: Uint8Array, bytes: number) => bytes % 512 === 0 && isEnd(end),
};

function expectFile(files: ReadonlyMap<string, Uint8Array>, { file, bytes }: ManifestEntry): void {
  const found = files.get(file)?.length;
  if (found === bytes) return;
  throw new Broken(`${file} has ${found ?? "no"} bytes in the archive, expected ${bytes}`);
}
