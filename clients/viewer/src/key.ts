/** Asks for the key that the service wants. */

import { el, id } from "./dom.ts";

/** take: gets the key. Shown once at a time. */
export class KeyDialog {
  readonly #dialog: HTMLDialogElement;
  readonly #text = el("p");
  readonly #field = el("input", {
    type: "password",
    id: id(),
    autocomplete: "off",
    required: true,
  });

  constructor(host: HTMLElement, take: (key: string) => void) {
    const form = el(
      "form",
      {},
      el("h2", {}, "A key, please"),
      this.#text,
      el("label", { for: this.#field.id }, "API key or token"),
      this.#field,
      el("p", { class: "about" }, "Kept in this tab alone, and gone when it closes."),
      el("button", { type: "submit", class: "act" }, "Use this key"),
    );
    form.addEventListener("submit", (event) => {
      event.preventDefault();
      this.#dialog.close();
      take(this.#field.value.trim());
      this.#field.value = "";
    });
    this.#dialog = el("dialog", { "aria-label": "A key, please" }, form);
    host.append(this.#dialog);
  }

  ask(why: string): void {
    this.#text.textContent = why;
    if (!this.#dialog.open) this.#dialog.showModal();
  }
}
