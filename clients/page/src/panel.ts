/** The controls of a model as sliders, and the choices of the page. */

import type { Model, Options } from "@posefield/runtime";

export interface PageState {
  controls: Record<string, number>;
  performer: string;
  level: number;
  feet: boolean;
  body: "mannequin" | "stick";
  view: "clip" | "walk";
  count: number;
}

export interface Listeners {
  /** Another value of a control or an option. */
  readonly change: () => void;
  /** Another view. */
  readonly show: () => void;
  readonly open: (model: string) => void;
  readonly download: () => void;
}

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
    this.state = {
      ...{ controls: defaults, performer: "", level: 0, feet: true, body: "mannequin" },
      ...{ view: "clip", count: 1 },
    };
    form.replaceChildren();
    const names = models.map(({ name }) => name);
    if (names.length > 1) this.#choice("Model", names, opened.name, listeners.open);
    if (isWalk(model))
      this.#choice("View", ["clip", "walk"], "clip", (view) => {
        this.state.view = view as PageState["view"];
        listeners.show();
      });
    for (const { name, description, minimum, maximum, unit } of card.controls)
      this.#slider(`${name}${unit ? `, ${unit}` : ""}`, minimum, maximum, defaults[name]!, {
        title: description,
        set: (value) => {
          this.state.controls = { ...this.state.controls, [name]: value };
          listeners.change();
        },
      });
    const performers = card.labels.find(({ name }) => name === "performer")?.names ?? [];
    if (performers.length)
      this.#choice("Performer", ["", ...performers], "", (name) => {
        this.state.performer = name;
        listeners.show();
      });
    const levels = card.levels.map((_, level) => String(level));
    this.#choice("Level of detail", levels, "0", (level) => {
      this.state.level = Number(level);
      listeners.show();
    });
    this.#choice("Feet", ["stand", "as predicted"], "stand", (feet) => {
      this.state.feet = feet === "stand";
      listeners.change();
    });
    this.#choice("Body", ["mannequin", "stick"], "mannequin", (body) => {
      this.state.body = body as PageState["body"];
      listeners.show();
    });
    if (isWalk(model))
      this.#slider("Walkers", 1, 200, 1, {
        step: 1,
        set: (count) => {
          this.state.count = count;
          if (this.state.view === "walk") listeners.show();
        },
      });
    const download = document.createElement("button");
    download.textContent = "Download GLB";
    download.addEventListener("click", listeners.download);
    form.append(download);
  }

  /** Options of questions. */
  get options(): Options & { readonly feet?: "as_predicted" } {
    const { performer, level, feet } = this.state;
    return {
      level,
      ...(performer ? { performer } : {}),
      ...(feet ? {} : { feet: "as_predicted" as const }),
    };
  }

  #choice(
    text: string,
    values: readonly string[],
    chosen: string,
    set: (value: string) => void,
  ): void {
    const select = document.createElement("select");
    select.append(...values.map((value) => new Option(value || "unseen", value)));
    select.value = chosen;
    select.addEventListener("change", () => set(select.value));
    this.#labelled(text, select);
  }

  #slider(
    text: string,
    low: number,
    high: number,
    value: number,
    {
      set,
      title = "",
      step = (high - low) / 200,
    }: {
      readonly set: (value: number) => void;
      readonly title?: string;
      readonly step?: number;
    },
  ): void {
    const input = document.createElement("input");
    Object.assign(input, { type: "range", min: low, max: high, step, title, valueAsNumber: value });
    const output = document.createElement("output");
    const write = () => {
      output.textContent = step === 1 ? input.value : input.valueAsNumber.toFixed(2);
    };
    input.addEventListener("input", () => {
      write();
      set(input.valueAsNumber);
    });
    write();
    this.#labelled(text, output, input);
  }

  #labelled(text: string, ...nodes: readonly Node[]): void {
    const label = document.createElement("label");
    label.append(text, ...nodes);
    this.#form.append(label);
  }
}

/** True for a cycle with a speed, which walkers need. */
export function isWalk({ card }: Model): boolean {
  const speeds = card.controls.filter(({ measure }) => measure?.quantity === "speed");
  return card.cyclic && card.root === "travelling" && speeds.length > 0 && card.contacts.length > 0;
}
