/** Reads a motion file aside, so that the page goes on, and can be ended. */

import { report } from "./report.ts";

/** A file, and all that came with it. */
export interface Asked {
  readonly file: File;
  readonly among: readonly File[];
}

addEventListener("message", async ({ data: { file, among } }: MessageEvent<Asked>) => {
  postMessage(await report(file, among));
});
