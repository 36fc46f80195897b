/** Faults in words: the notice that shows them, and the dialog that asks for a key. */

import { PosefieldError, Problem, TimedOut, Unexpected, Unreachable } from "@posefield/client";

import { button, el, id } from "./dom.ts";
import { usable } from "./service.ts";

/** wait: retry until /readyz is well. key: ask for one. model: it is gone, show another. */
export type Remedy = "wait" | "key" | "model" | "none";

export interface Fault {
  readonly text: string;
  readonly remedy: Remedy;
}

/** Return the fault in words; null for requests that this page has aborted. */
export function understood(fault: unknown): Fault | null {
  if (typeof fault === "string") return { text: fault, remedy: "none" };
  if (fault instanceof DOMException && fault.name === "AbortError") return null;
  if (fault instanceof DOMException && fault.name === "TimeoutError") return SLOW;
  if (fault instanceof TimedOut) return SLOW;
  if (fault instanceof Unreachable) return DOWN;
  if (fault instanceof Problem) return refused(fault);
  if (fault instanceof Unexpected) {
    const text = `The answer makes no sense here, maybe from another version or something in between: ${fault.message}. Trying again.`;
    return { text, remedy: "wait" };
  }
  if (fault instanceof PosefieldError) return { text: fault.message, remedy: "none" };
  return { text: `Something in this page went wrong: ${fault}`, remedy: "none" };
}

const DOWN: Fault = {
  text: "The service does not answer. The last picture stays; trying again until it does.",
  remedy: "wait",
};

const SLOW: Fault = {
  text: "The service took too long to answer. The last picture stays; trying again.",
  remedy: "wait",
};

function refused(fault: Problem): Fault {
  if (fault.status === 401) return { text: "The service asks for a key.", remedy: "key" };
  if (fault.status === 403)
    return { text: `This key does not open that: ${fault.detail}`, remedy: "key" };
  if (fault.kind === "unknown-model") return { text: fault.message, remedy: "model" };
  if (fault.status === 429 || fault.status >= 500)
    return {
      text: `The service is busy or restarting (${fault.message}). The last picture stays; trying again.`,
      remedy: "wait",
    };
  return { text: fault.message, remedy: "none" };
}

/** One fault, which goes by itself, and a remark on each subject, which the user closes. */
export class Notice {
  readonly #host: HTMLElement;
  readonly #words = el("span");
  readonly #fault = el("p", { class: "fault", hidden: true }, this.#words);
  readonly #remarks = new Map<"version" | "model", HTMLElement>();

  constructor(host: HTMLElement) {
    this.#host = host;
    host.append(this.#fault);
  }

  /** remedy: a button that may help. */
  fault(text: string | null, remedy: HTMLButtonElement | null = null): void {
    // Written once, so that screen readers do not repeat it.
    if (this.#words.textContent !== (text ?? "")) this.#words.textContent = text;
    if (this.#fault.children[1] !== (remedy ?? undefined))
      this.#fault.replaceChildren(this.#words, ...(remedy ? [remedy] : []));
    this.#fault.hidden = !text;
  }

  remark(subject: "version" | "model", text: string | null): void {
    const before = this.#remarks.get(subject);
    if (before?.firstElementChild?.textContent === text) return;
    before?.remove();
    this.#remarks.delete(subject);
    if (!text) return;
    const close = button("Close", "Close this notice", () => this.remark(subject, null));
    const remark = el("p", { class: "remark" }, el("span", {}, text), close);
    this.#remarks.set(subject, remark);
    this.#host.append(remark);
  }
}

/** Dialog for a key; it opens by itself until the user has closed it. */
export class KeyDialog {
  readonly opener = button("Enter a key", "Enter a key", () => this.#dialog.showModal());
  readonly #text = el("p");
  readonly #field = el("input", {
    type: "password",
    id: id(),
    autocomplete: "off",
    required: true,
  });
  readonly #fault = el("p", { class: "fault", role: "alert" });
  readonly #form = el(
    "form",
    {},
    el("h2", {}, "A key, please"),
    this.#text,
    el("label", { for: this.#field.id }, "API key or token"),
    this.#field,
    this.#fault,
    el("p", { class: "about" }, "Kept in this tab alone, and gone when it closes."),
    el("button", { type: "submit", class: "act" }, "Use this key"),
  );
  readonly #dialog = el("dialog", { "aria-label": "A key, please" }, this.#form);
  readonly #use: (key: string) => void;
  #dismissed = false;

  constructor(host: HTMLElement, use: (key: string) => void) {
    this.#use = use;
    this.#form.addEventListener("submit", (event) => {
      event.preventDefault();
      this.#enter(this.#field.value.trim());
    });
    this.#dialog.addEventListener("cancel", () => {
      this.#dismissed = true;
    });
    host.append(this.#dialog);
  }

  ask(why: string): void {
    this.#text.textContent = why;
    if (!this.#dialog.open && !this.#dismissed) this.#dialog.showModal();
  }

  #enter(key: string): void {
    this.#fault.textContent = usable(key) ? "" : UNUSABLE;
    if (!usable(key)) return;
    this.#dialog.close();
    this.#dismissed = false;
    this.#field.value = "";
    this.#use(key);
  }
}

const UNUSABLE =
  "This cannot be a key: keys are letters, digits and signs of ASCII, without spaces. Copy it again, all of it and nothing else.";
