/** What happened: one fault, which goes by itself, and a remark on each subject, which one closes. */

import { button, el } from "./dom.ts";

/** version: of the service and this page. model: which is shown, and what of its address is. */
export type Subject = "version" | "model";

export class Notice {
  readonly #host: HTMLElement;
  readonly #fault = el("p", { class: "fault" });
  readonly #words = el("span");
  readonly #remarks = new Map<Subject, HTMLElement>();

  constructor(host: HTMLElement) {
    this.#host = host;
    this.#fault.hidden = true;
    this.#fault.append(this.#words);
    host.append(this.#fault);
  }

  /** way: a button that may help. */
  fault(text: string | null, way: HTMLButtonElement | null = null): void {
    // Said once: who listens to the page does not want it again and again.
    if (this.#words.textContent !== (text ?? "")) this.#words.textContent = text;
    if (this.#fault.children[1] !== (way ?? undefined))
      this.#fault.replaceChildren(this.#words, ...(way ? [way] : []));
    this.#fault.hidden = !text;
  }

  remark(subject: Subject, text: string | null): void {
    const said = this.#remarks.get(subject);
    if (said?.firstElementChild?.textContent === text) return;
    said?.remove();
    this.#remarks.delete(subject);
    if (!text) return;
    const close = button("Close", "Close this notice", () => this.remark(subject, null));
    const made = el("p", { class: "remark" }, el("span", {}, text), close);
    this.#remarks.set(subject, made);
    this.#host.append(made);
  }
}
