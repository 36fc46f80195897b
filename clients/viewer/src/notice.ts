/** The line that says what happened: one fault, which goes by itself, and remarks, which one closes. */

import { button, el } from "./dom.ts";

export class Notice {
  readonly #fault = el("p", { class: "fault" });
  readonly #remark = el("p", { class: "remark" });

  constructor(host: HTMLElement) {
    const close = button("Close", "Close this notice", () => this.remark(null));
    this.#remark.hidden = this.#fault.hidden = true;
    this.#remark.append(el("span"), close);
    host.append(this.#fault, this.#remark);
  }

  fault(text: string | null): void {
    // Said once: who listens to the page does not want it again and again.
    if (this.#fault.textContent !== (text ?? "")) this.#fault.textContent = text;
    this.#fault.hidden = !text;
  }

  remark(text: string | null): void {
    this.#remark.firstElementChild!.textContent = text;
    this.#remark.hidden = !text;
  }
}
