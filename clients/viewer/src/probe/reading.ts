/** Reports on files by a worker, one after the other, each within a time. */

import { toReport } from "./accepted.ts";
import type { Report } from "./report.ts";
import type { Asked } from "./worker.ts";
import Reader from "./worker.ts?worker&inline";

const LONGEST = 30_000;
/** Files a time. */
export const MOST_FILES = 20;

/** Until the signal. take: gets each report; begin: is told of each file that is read. */
export async function readFiles(
  files: readonly File[],
  begin: (name: string) => void,
  take: (report: Report) => void,
  signal: AbortSignal,
): Promise<void> {
  for (const file of toReport(files).slice(0, MOST_FILES)) {
    if (signal.aborted) return;
    begin(file.name);
    const found = await within({ file, among: files }, signal);
    if (found) take(found);
  }
}

/** A worker of its own, so that a damaged file takes nothing else with it. */
function within(asked: Asked, signal: AbortSignal): Promise<Report | null> {
  const reader = new Reader();
  let late: ReturnType<typeof setTimeout>;
  return new Promise<Report | null>((done) => {
    const refuse = (said: string) => done(refusal(asked.file, said));
    late = setTimeout(() => refuse(TOO_LONG), LONGEST);
    signal.addEventListener("abort", () => done(null), { once: true });
    reader.addEventListener("message", ({ data }: MessageEvent<Report>) => done(data));
    reader.addEventListener("error", ({ message }) =>
      refuse(`cannot be read on this page: ${message || "the reader ended"}`),
    );
    reader.postMessage(asked);
  }).finally(() => {
    clearTimeout(late);
    reader.terminate();
  });
}

const TOO_LONG = `took longer than ${LONGEST / 1000} s, and was given up: it may be damaged. posefield probe reads it`;

function refusal({ name }: File, said: string): Report {
  return { file: name, said, refused: true, facts: [], warnings: [], notes: [] };
}
