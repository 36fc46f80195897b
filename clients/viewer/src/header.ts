/** The bar at the top: which model, which view, light or dark, and help. */

import type { ModelSummary } from "@posefield/client";

import { button, choice, el, icon, id } from "./dom.ts";
import { shareButton } from "./share.ts";
import type { Store, View } from "./state.ts";
import * as theme from "./theme.ts";

const VIEWS = [
  ["one", "Single"],
  ["crowd", "Crowd"],
  ["performance", "Performance"],
] as const;

const KEYS = [
  ["Space", "play or pause"],
  ["← →", "one frame back or forward"],
  ["Shift ← →", "ten frames"],
  ["Home End", "first or last frame"],
  ["R", "reset all controls"],
  ["L", "loop"],
  ["G", "ghost of the nearest example"],
  ["N", "next take"],
  ["P", "back to the prediction"],
  ["V", "fan of other takes"],
  ["S", "feet stand, or are as predicted"],
  ["F", "contacts and skate of the feet"],
  ["B", "mannequin or sticks"],
  ["T", "light or dark"],
] as const;

export class Header {
  readonly #models = el("select", { id: id() });
  readonly #about = el("p", { class: "about", "data-about": "" });
  readonly #views: ReturnType<typeof choice<View>>;
  #store: Store | null = null;

  /** open: shows another model. */
  constructor(host: HTMLElement, open: (model: string) => void) {
    this.#models.addEventListener("change", () => open(this.#models.value));
    this.#views = choice<View>("View", VIEWS, (view) => this.#store?.set({ view }));
    const help = helped();
    const sign = el("button", { type: "button", popovertarget: help.id, class: "sign" }, "Keys");
    const shade = button(icon("light"), "Light or dark (T)", theme.toggle);
    host.append(
      el("h1", {}, "posefield"),
      el("span", { class: "field" }, el("label", { for: this.#models.id }, "Model"), this.#models),
      this.#about,
      this.#views,
      shareButton(),
      shade,
      sign,
      help,
    );
  }

  list(models: readonly ModelSummary[], shown: string): void {
    const names = models.map(({ name }) => name);
    const all = names.includes(shown) ? names : [shown, ...names];
    const before = [...this.#models.options].map(({ value }) => value);
    if (before.join("\n") !== all.join("\n"))
      this.#models.replaceChildren(...all.map((name) => el("option", { value: name }, name)));
    this.#models.value = shown;
    const found = models.find(({ name }) => name === shown);
    this.#about.textContent = found?.description ?? "";
  }

  /** Says which model is shown, where another was chosen and never came. */
  choose(shown: string): void {
    this.#models.value = shown;
  }

  follow(store: Store, signal: AbortSignal): void {
    this.#store = store;
    const show = () => this.#views.set(store.state.view);
    show();
    signal.addEventListener("abort", store.listen(show));
  }
}

function helped(): HTMLElement {
  const rows = KEYS.flatMap(([key, what]) => [
    el("dt", {}, el("kbd", {}, key)),
    el("dd", {}, what),
  ]);
  return el(
    "div",
    { popover: "auto", id: id(), class: "help", role: "dialog", "aria-label": "Keys" },
    el("h2", {}, "Keys"),
    el("dl", {}, ...rows),
    el(
      "p",
      { class: "about" },
      "Drag turns the view, the wheel or two fingers bring it nearer, the right button or two fingers move it.",
    ),
  );
}
