/** The controls of a model as sliders, and the choices of the page. */

import type { ClipOptions, Model } from "@posefield/runtime";
import { chooser, el, textButton } from "../../viewer/src/dom.ts";
import { MANY } from "./walk-view.ts";

export interface PageState {
  controls: Record<string, number>;
  options: ClipOptions;
  body: "mannequin" | "stick";
  view: "clip" | "walk";
  count: number;
}

/** Actions for another value of a control, another view or model, and the button. */
export interface Listeners {
  readonly change: () => void;
  readonly show: () => void;
  readonly open: (model: string) => void;
  readonly download: () => void;
}

const WALKERS = `Walkers, drawn as sticks above ${MANY}`;

export class Panel {
  readonly state: PageState;
  readonly #form: HTMLFormElement;

  constructor(
    form: HTMLFormElement,
    model: Model,
    models: readonly { readonly name: string }[],
    opened: { readonly name: string },
    listeners: Listeners,
  ) {
    const { card, defaults } = model;
    this.#form = form;
    this.state = { controls: defaults, options: {}, body: "mannequin", view: "clip", count: 1 };
    form.replaceChildren();
    const names = models.map(({ name }) => name);
    if (names.length > 1) this.#choice("Model", names, opened.name, listeners.open);
    const { show, change } = listeners;
    const put = (values: Partial<PageState>, then: () => void) => {
      Object.assign(this.state, values);
      then();
    };
    if (model.walks)
      this.#choice("View", ["clip", "walk"], "clip", (view) => {
        // Arrow keys then steer, and choose no other view.
        (document.activeElement as HTMLElement).blur();
        put({ view: view as PageState["view"] }, show);
        form.dataset["view"] = view;
      });
    form.dataset["view"] = "clip";
    for (const { name, description, minimum, maximum, unit, measure } of card.controls) {
      const text = `${name}${unit ? `, ${unit}` : ""}`;
      const range = [minimum, maximum, (maximum - minimum) / 200] as const;
      const set = (value: number) =>
        put({ controls: { ...this.state.controls, [name]: value } }, change);
      // Steering sets the turn, and the other controls follow the speed.
      const only = measure?.quantity === "speed" ? "" : "clip";
      this.#slider(text, range, defaults[name]!, set, description, only);
    }
    const choose = (values: ClipOptions, then = show) =>
      put({ options: { ...this.state.options, ...values } }, then);
    const performers = card.labels.find(({ name }) => name === "performer")?.names ?? [];
    if (performers.length)
      this.#choice("Performer", ["", ...performers], "", (performer) =>
        choose({ performer: performer || undefined }),
      );
    const levels = card.levels.map((_, level) => String(level));
    this.#choice("Level of detail", levels, "0", (level) => choose({ level: Number(level) }));
    const set = (feet: string) =>
      choose({ feet: feet === "stand" ? undefined : "as_predicted" }, change);
    if (model.stands) this.#choice("Feet", ["stand", "as predicted"], "stand", set, "clip");
    const bodies = ["mannequin", "stick"] as const;
    this.#choice("Body", bodies, bodies[0], (body) =>
      put({ body: body as PageState["body"] }, show),
    );
    if (model.walks)
      this.#slider(WALKERS, [1, 200, 1], 1, (count) => put({ count }, show), "", "walk");
    const download = textButton("Download GLB", listeners.download);
    download.title = "The clip with its skin; the command posefield clip writes VRMA, USD and BVH";
    download.dataset["only"] = "clip";
    form.append(download);
  }

  #choice(
    text: string,
    values: readonly string[],
    chosen: string,
    set: (value: string) => void,
    only: PageState["view"] | "" = "",
  ): void {
    const names = values.map((value) => [value, value || "unseen"] as const);
    this.#form.append(el("label", { "data-only": only }, text, chooser(names, chosen, set)));
  }

  #slider(
    text: string,
    [min, max, step]: readonly [number, number, number],
    value: number,
    set: (value: number) => void,
    title = "",
    only: PageState["view"] | "" = "",
  ): void {
    const input = el("input", { type: "range", min, max, step, title, value });
    const output = el("output");
    const write = () => {
      output.textContent = step === 1 ? input.value : input.valueAsNumber.toFixed(2);
    };
    input.addEventListener("input", () => {
      write();
      set(input.valueAsNumber);
    });
    write();
    // Arrow keys then steer, and move no slider.
    input.addEventListener("pointerup", () => input.blur());
    this.#form.append(el("label", { "data-only": only }, text, output, input));
  }
}
