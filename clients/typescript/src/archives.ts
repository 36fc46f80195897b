/** Archives of many clips or performances: tar and zip of stored files, whose last file is a manifest of the others. */

import { lines } from "./documents.ts";
import { Broken } from "./errors.ts";
import { isEnd, members as tarMembers } from "./tar.ts";
import type { ArchiveFormat, Download, ManifestEntry, PerformanceEntry } from "./types.ts";
import { members as zipMembers } from "./zip.ts";

export type Member = readonly [path: string, content: Uint8Array<ArrayBuffer>];

/** So many bytes at the end of an archive say whether it is whole. */
export const END = 1024;

const MANIFEST = "manifest.jsonl";
const MEMBERS = { zip: zipMembers, tar: tarMembers };

/** Lines of manifests, by their names in the contract. */
interface Entries {
  ManifestEntry: ManifestEntry;
  PerformanceEntry: PerformanceEntry;
}

/** A file whose members are there as its manifest says. */
interface Opened<Entry> extends Download {
  readonly entries: readonly Entry[];
  readonly files: ReadonlyMap<string, Uint8Array<ArrayBuffer>>;
}

/** The files of an archive that was asked for so many; Broken where not all are there. */
export function opened<Name extends keyof Entries>(
  download: Download,
  format: ArchiveFormat,
  count: number,
  form: Name,
): Opened<Entries[Name]> {
  const members = [...MEMBERS[format](download.content)];
  const [name, manifest] = members.pop() ?? [];
  if (name !== MANIFEST || !manifest) {
    throw new Broken(`the archive ends with ${name ?? "nothing"}, expected ${MANIFEST}`);
  }
  const files = new Map(members);
  const entries = lines(form, manifest);
  if (entries.length !== count) {
    throw new Broken(`the archive holds ${entries.length} clips, expected ${count}`);
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

function expectFile(
  files: ReadonlyMap<string, Uint8Array>,
  { file, bytes }: Pick<ManifestEntry, "file" | "bytes">,
): void {
  const found = files.get(file)?.length;
  if (found === bytes) return;
  throw new Broken(`${file} has ${found ?? "no"} bytes in the archive, expected ${bytes}`);
}
