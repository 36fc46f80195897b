/** A map of two controls: where answers are to be trusted, what was captured, and where one is. */

import type { SigmaGrid } from "@posefield/client";

import "./map.css";
import { type Control, type Dot, draw, Frame, heat, MARGIN, rounded } from "./chart.ts";
import { chooser, el, labelled } from "./dom.ts";
import { clips, distance, labelsOf, mover, nearestTo, others } from "./examples.ts";
import { Latest } from "./latest.ts";
import { legend, said, table } from "./map-words.ts";
import type { Mount, Page } from "./page.ts";
import { title } from "./slider.ts";
import type { State } from "./state.ts";
import * as theme from "./theme.ts";
import { type Veil, veil } from "./veil.ts";
import { figure, precise } from "./written.ts";

const [COLUMNS, ROWS] = [48, 36];
/** Milliseconds that other controls rest before the map is asked for anew. */
const REST = 120;
/** Pixels within which a dot is meant. */
const REACH = 11;
/** Pixels that a finger or a mouse may tremble on a dot. */
const TREMBLE = 4;
/** Milliseconds after which where one is is said aloud. */
const CALM = 400;

export const mount: Mount = (host, page) => {
  if (page.card.controls.length < 2) {
    host.append(el("p", { class: "map-none" }, "A map needs two controls; this model has one."));
    return;
  }
  new Map2(host, page).begin();
};

class Map2 {
  readonly #page: Page;
  readonly #canvas = el("canvas", { tabindex: 0, class: "map-canvas" });
  readonly #tip = el("div", { class: "map-tip", hidden: true });
  readonly #here = el("p", { class: "map-here" });
  readonly #aloud = el("p", { class: "unseen" });
  readonly #words = el("p", { class: "map-words", id: "map-words" });
  readonly #legend = legend();
  readonly #table = el("table");
  readonly #across: HTMLSelectElement;
  readonly #along: HTMLSelectElement;
  readonly #asking: Latest<string>;
  #grid: SigmaGrid | null = null;
  #picture: HTMLCanvasElement | null = null;
  #veil: Veil | null = null;
  #chosen: number | null = null;
  #asked = "";
  #waiting = 0;
  #drawn = 0;
  #speaking = 0;
  /** Where a dot was pressed; null where none was, or the pointer has left it since. */
  #pressed: readonly [number, number] | null = null;

  constructor(host: HTMLElement, page: Page) {
    this.#page = page;
    this.#asking = new Latest((key) => this.#ask(key));
    const names = page.card.controls.map(({ name }) => [name, title(name)] as const);
    this.#across = chooser(names, "", (value) => this.#take("across", value));
    this.#along = chooser(names, "", (value) => this.#take("along", value));
    const axes = el(
      "div",
      { class: "map-axes" },
      labelled("across", this.#across),
      labelled("up", this.#along),
    );
    const tables = el("details", {}, el("summary", {}, "Sigma as a table"), this.#table);
    const frame = el("div", { class: "map-frame" }, this.#canvas, this.#tip);
    host.append(
      el(
        "section",
        { class: "map", "aria-label": "Map of two controls" },
        el("h2", {}, "Map"),
        axes,
        frame,
        this.#legend.host,
        this.#here,
        this.#aloud,
        this.#words,
        tables,
      ),
    );
    this.#aloud.setAttribute("aria-live", "polite");
    this.#canvas.setAttribute("role", "application");
    this.#canvas.setAttribute("aria-roledescription", "map of two controls");
    this.#canvas.setAttribute("aria-describedby", "map-words");
  }

  begin(): void {
    const { store, signal } = this.#page;
    const stop = store.listen((_, changed) => this.#changed(changed));
    signal.addEventListener("abort", stop);
    theme.listen(() => this.#redraw(), signal);
    const watch = new ResizeObserver(() => this.#redraw());
    watch.observe(this.#canvas);
    signal.addEventListener("abort", () => {
      watch.disconnect();
      clearTimeout(this.#waiting);
      clearTimeout(this.#speaking);
    });
    this.#listen();
    this.#choosers();
    this.#renew(0);
  }

  get #state(): State {
    return this.#page.store.state;
  }

  /** The controls of the two axes: those of the state, or the first that there are. */
  get #pair(): [Control, Control] {
    const all = this.#page.card.controls;
    const across = all.find(({ name }) => name === this.#state.across) ?? all[0]!;
    const along =
      all.find((one) => one.name === this.#state.along && one !== across) ??
      all.find((one) => one !== across)!;
    return [across, along];
  }

  get #point(): [number, number] {
    const [across, along] = this.#pair;
    const value = (one: Control) => this.#state.controls[one.name] ?? one.default;
    return [value(across), value(along)];
  }

  get #frame(): Frame {
    return new Frame(...this.#pair, this.#canvas.clientWidth, this.#canvas.clientHeight);
  }

  get #dots(): Dot[] {
    return clips(this.#page.card, this.#pair, this.#state.controls);
  }

  #changed(changed: ReadonlySet<keyof State>): void {
    if (changed.has("across") || changed.has("along")) this.#choosers();
    const asked = ["across", "along", "controls", "performer", "labels"] as const;
    if (!asked.some((key) => changed.has(key))) return;
    this.#chosen = null;
    this.#tell();
    this.#redraw();
    this.#renew(REST);
  }

  #choosers(): void {
    const [across, along] = this.#pair;
    this.#across.value = across.name;
    this.#along.value = along.name;
  }

  /** Who chooses the other axis' control changes the two over. */
  #take(key: "across" | "along", value: string): void {
    const [across, along] = this.#pair;
    const other = key === "across" ? "along" : "across";
    const now = { across: across.name, along: along.name };
    const left = now[other] === value ? now[key] : now[other];
    this.#page.store.set({ ...now, [other]: left, [key]: value });
  }

  /** Asks for sigma where it is of other controls than the map that is shown. */
  #renew(rest: number): void {
    const key = JSON.stringify([
      ...this.#pair.map(({ name }) => name),
      others(this.#state.controls, this.#pair),
      this.#state.performer,
      this.#state.labels,
    ]);
    clearTimeout(this.#waiting);
    if (key === this.#asked) {
      this.#tell();
      return;
    }
    this.#waiting = window.setTimeout(() => {
      this.#asked = key;
      this.#asking.ask(key);
    }, rest);
  }

  async #ask(key: string): Promise<void> {
    const { source, card, signal, notice } = this.#page;
    const [across, along] = this.#pair;
    const question = {
      across: across.name,
      along: along.name,
      columns: COLUMNS,
      rows: ROWS,
      margin: MARGIN,
      controls: others(this.#state.controls, this.#pair),
      performer: this.#state.performer,
      labels: this.#state.labels,
    };
    try {
      const grid = await source.sigma(this.#state.model || card.name, question, signal);
      if (key === this.#asked) this.#show(grid);
    } catch (fault) {
      if (key === this.#asked) this.#asked = "";
      if (!signal.aborted) notice(fault);
    }
  }

  #show(grid: SigmaGrid): void {
    this.#grid = grid;
    this.#picture = heat(grid);
    this.#veil = grid.supported ? veil(grid.supported) : null;
    this.#legend.show(grid, this.#page.card);
    this.#words.textContent = said(grid, this.#pair);
    this.#table.replaceChildren(...table(grid, this.#pair));
    this.#redraw();
  }

  #redraw(): void {
    if (this.#drawn) return;
    this.#drawn = requestAnimationFrame(() => {
      this.#drawn = 0;
      this.#draw();
    });
  }

  #draw(): void {
    const { clientWidth: width, clientHeight: height } = this.#canvas;
    const ratio = Math.min(2, devicePixelRatio);
    if (!width || this.#page.signal.aborted) return;
    [this.#canvas.width, this.#canvas.height] = [width * ratio, height * ratio];
    const pen = this.#canvas.getContext("2d")!;
    pen.scale(ratio, ratio);
    const pair = this.#pair;
    const fits = this.#grid?.across === pair[0].name && this.#grid.along === pair[1].name;
    draw(pen, {
      frame: this.#frame,
      controls: pair,
      picture: fits ? this.#picture : null,
      veil: fits ? this.#veil : null,
      inside: this.#inside(),
      dots: this.#dots,
      point: this.#point,
      chosen: this.#chosen,
    });
    this.#tell();
  }

  #inside(): boolean {
    return this.#page.card.controls
      .filter((control) => !this.#pair.includes(control))
      .every(({ name, minimum, maximum }) => {
        const value = this.#state.controls[name] ?? minimum;
        return value >= minimum && value <= maximum;
      });
  }

  /** Where one is, for those who read and those who hear. */
  #tell(): void {
    const [across, along] = this.#pair;
    const [x, y] = this.#point;
    const where = `${across.name} ${figure(x)} ${across.unit}, ${along.name} ${figure(y)} ${along.unit}`;
    const { index, apart } = nearestTo(this.#page.card, this.#state.controls);
    const near = `nearest example ${this.#name(index)}${apart < 1e-9 ? ", exactly" : ""}`;
    this.#here.textContent = `${where}; ${near}`;
    this.#canvas.setAttribute(
      "aria-label",
      `Map: ${where}; ${near}. Arrows move, page keys go to examples`,
    );
    this.#speak();
  }

  /** Once it rests, and only to those who move by keys. */
  #speak(): void {
    clearTimeout(this.#speaking);
    this.#speaking = window.setTimeout(() => {
      if (document.activeElement === this.#canvas) this.#aloud.textContent = this.#here.textContent;
    }, CALM);
  }

  #name(index: number): string {
    return this.#page.card.sources[index] ?? `clip ${index + 1}`;
  }

  #listen(): void {
    const [canvas, { signal }] = [this.#canvas, this.#page];
    const on = <Kind extends keyof HTMLElementEventMap>(
      kind: Kind,
      act: (event: HTMLElementEventMap[Kind]) => void,
    ) => canvas.addEventListener(kind, act, { signal });
    on("pointerdown", (event) => {
      canvas.setPointerCapture(event.pointerId);
      const met = this.#met(event);
      this.#pressed = met && [event.offsetX, event.offsetY];
      if (met) this.#example(met.index);
      else this.#go(event);
    });
    on("pointermove", (event) => {
      if (event.buttons & 1 && canvas.hasPointerCapture(event.pointerId)) this.#drag(event);
      else this.#hover(event);
    });
    on("pointerleave", () => this.#point_out(null));
    on("keydown", (event) => this.#key(event));
    on("blur", () => this.#point_out(null));
  }

  #drag(event: PointerEvent): void {
    const [x, y] = this.#pressed ?? [Number.NaN, Number.NaN];
    if (Math.hypot(event.offsetX - x, event.offsetY - y) < TREMBLE) return;
    this.#pressed = null;
    this.#go(event);
  }

  #go(event: PointerEvent): void {
    this.#set(this.#frame.values(event.offsetX, event.offsetY));
  }

  #set([x, y]: readonly [number, number]): void {
    const [across, along] = this.#pair;
    const controls = { ...this.#state.controls, [across.name]: x, [along.name]: y };
    this.#page.store.set({ controls });
  }

  /** The clip whose dot is under the pointer, the nearest first. */
  #met(event: PointerEvent): Dot | null {
    const frame = this.#frame;
    const far = (dot: Dot) =>
      Math.hypot(frame.x(dot.at[0]) - event.offsetX, frame.y(dot.at[1]) - event.offsetY);
    const [first] = this.#dots.filter((dot) => far(dot) < REACH).sort((a, b) => far(a) - far(b));
    return first ?? null;
  }

  #hover(event: PointerEvent): void {
    this.#point_out(this.#met(event)?.index ?? null);
  }

  #point_out(index: number | null): void {
    this.#tip.hidden = index === null;
    if (index === this.#chosen) return;
    this.#chosen = index;
    if (index !== null) this.#label(index);
    this.#redraw();
  }

  #label(index: number): void {
    const dot = this.#dots[index]!;
    const left = this.#page.card.left_out?.[index];
    const lines = [this.#name(index)];
    if (left !== undefined) lines.push(`left out: ${precise(left)} away`);
    const apart = distance(this.#page.card, this.#state.controls, index);
    if (apart > 0.02) lines.push(`other controls: ${figure(100 * apart)} % of a range away`);
    this.#tip.replaceChildren(...lines.map((line) => el("div", {}, line)));
    const [x, y] = [this.#frame.x(dot.at[0]), this.#frame.y(dot.at[1])];
    this.#tip.style.left = `${Math.min(x + 12, this.#canvas.clientWidth - 190)}px`;
    this.#tip.style.top = `${y + 12}px`;
  }

  /** Goes to a captured clip with all of its controls, as who moved it. */
  #example(index: number): void {
    const { card, store } = this.#page;
    const values = card.examples[index]!;
    const controls = Object.fromEntries(card.controls.map(({ name }, i) => [name, values[i]!]));
    store.set({ controls, performer: mover(card, index), labels: labelsOf(card, index) });
    this.#point_out(index);
  }

  #key(event: KeyboardEvent): void {
    const [across, along] = this.#pair;
    const step = event.shiftKey ? 0.1 : 0.02;
    const [x, y] = this.#point;
    const moved = (control: Control, value: number, sign: number) => {
      const size = control.maximum - control.minimum;
      const [low, high] = [control.minimum - MARGIN * size, control.maximum + MARGIN * size];
      return rounded(Math.min(high, Math.max(low, value + sign * step * size)), size);
    };
    const acts: Record<string, () => void> = {
      ArrowLeft: () => this.#set([moved(across, x, -1), y]),
      ArrowRight: () => this.#set([moved(across, x, 1), y]),
      ArrowDown: () => this.#set([x, moved(along, y, -1)]),
      ArrowUp: () => this.#set([x, moved(along, y, 1)]),
      Home: () => this.#set([across.default, along.default]),
      PageDown: () => this.#step(1),
      PageUp: () => this.#step(-1),
    };
    const act = acts[event.key];
    if (!act || event.ctrlKey || event.metaKey || event.altKey) return;
    event.preventDefault();
    // The page has its own use for some of these keys.
    event.stopPropagation();
    act();
  }

  #step(by: number): void {
    const count = this.#page.card.examples.length;
    const from = this.#chosen ?? nearestTo(this.#page.card, this.#state.controls).index;
    this.#example((from + by + count) % count);
  }
}
