/** The address of what is shown, into the clipboard. */

import { el } from "./dom.ts";

const SAID = 2500;

/** A button that copies the page's address and says so. */
export function shareButton(): HTMLButtonElement {
  const made = el("button", { type: "button", class: "share" }, NAME);
  let timer: ReturnType<typeof setTimeout> | undefined;
  made.addEventListener("click", async () => {
    made.textContent = (await copied(location.href)) ? "Copied" : "Copy the address bar";
    clearTimeout(timer);
    timer = setTimeout(() => {
      made.textContent = NAME;
    }, SAID);
  });
  made.setAttribute("aria-live", "polite");
  return made;
}

const NAME = "Copy link";

async function copied(text: string): Promise<boolean> {
  try {
    await navigator.clipboard.writeText(text);
    return true;
  } catch {
    return false;
  }
}
