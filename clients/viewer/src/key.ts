/** Asks for the key that the service wants. */

import { button, el, id } from "./dom.ts";
import { usable } from "./service.ts";

/** Shown once at a time, and not by itself again when somebody has closed it. */
export class KeyDialog {
  /** Opens it when it was closed. */
  readonly opener = button("Enter a key", "Enter a key", () => this.#dialog.showModal());
  readonly #dialog: HTMLDialogElement;
  readonly #text = el("p");
  readonly #field = el("input", {
    type: "password",
    id: id(),
    autocomplete: "off",
    required: true,
  });

  readonly #fault = el("p", { class: "fault", role: "alert" });
  readonly #take: (key: string) => void;
  #dismissed = false;

  /** take: gets the key. */
  constructor(host: HTMLElement, take: (key: string) => void) {
    this.#take = take;
    const form = el(
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
    form.addEventListener("submit", (event) => {
      event.preventDefault();
      this.#entered(this.#field.value.trim());
    });
    this.#dialog = el("dialog", { "aria-label": "A key, please" }, form);
    this.#dialog.addEventListener("cancel", () => {
      this.#dismissed = true;
    });
    host.append(this.#dialog);
  }

  ask(why: string): void {
    this.#text.textContent = why;
    if (!this.#dialog.open && !this.#dismissed) this.#dialog.showModal();
  }

  #entered(key: string): void {
    this.#fault.textContent = usable(key) ? "" : UNUSABLE;
    if (!usable(key)) return;
    this.#dialog.close();
    this.#dismissed = false;
    this.#field.value = "";
    this.#take(key);
  }
}

const UNUSABLE =
  "This cannot be a key: keys are letters, digits and signs of ASCII, without spaces. Copy it again, all of it and nothing else.";
