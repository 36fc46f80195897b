/** Content that the browser saves as a file. */

import { el } from "./dom.ts";

export function saveFile(name: string, content: Blob): void {
  const address = URL.createObjectURL(content);
  const anchor = el("a", { href: address, download: name });
  anchor.click();
  // The browser has read it by then.
  setTimeout(() => URL.revokeObjectURL(address), 60_000);
}
