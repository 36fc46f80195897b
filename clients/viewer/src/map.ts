/** A map of two controls: sigma and support, the captured clips, and the current controls. */

import type { SigmaGrid } from "@posefield/client";

import { draw, Frame, heat, MARGIN, rounded, type Veil, veil } from "./chart.ts";
import { chooser, el, labelled } from "./dom.ts";
import {
  type Control,
  clips,
  type Dot,
  distance,
  labelsOf,
  nearestTo,
  others,
  performerOf,
} from "./examples.ts";
import { Latest } from "./latest.ts";
import { legend, summary, table } from "./map-words.ts";
import type { Session } from "./player.ts";
import { type Changes, has, type State, valuesOf } from "./state.ts";
import * as theme from "./theme.ts";
import { figure, precise, title } from "./written.ts";

const [COLUMNS, ROWS] = [48, 36];
/** Milliseconds without a change of other controls until the map is asked for. */
const REST = 120;
/** Pixels to a dot within which it is hit, and by which a press may tremble. */
const [HIT, TREMBLE] = [11, 4];
/** Milliseconds without a change until screen readers are told. */
const CALM = 400;

export function mount(host: HTMLElement, session: Session): void {
  if (session.card.controls.length < 2)
    host.append(el("p", { class: "about" }, "A map needs two controls; this model has one."));
  else new ControlMap(host, session);
}

class ControlMap {
  readonly #session: Session;
  readonly #canvas = el("canvas", {
    tabindex: 0,
    class: "map-canvas",
    role: "application",
    "aria-roledescription": "map of two controls",
    "aria-describedby": "map-words",
  });
  readonly #tip = el("div", { class: "map-tip", hidden: true });
  readonly #current = el("p", { class: "map-here" });
  readonly #aloud = el("p", { class: "unseen", "aria-live": "polite" });
  readonly #summary = el("p", { class: "map-words", id: "map-words" });
  readonly #legend = legend();
  readonly #table = el("table");
  readonly #across: HTMLSelectElement;
  readonly #along: HTMLSelectElement;
  readonly #latest = new Latest<string>((key) => this.#fetch(key));
  #grid: SigmaGrid | null = null;
  #picture: HTMLCanvasElement | null = null;
  #veil: Veil | null = null;
  #chosen: number | null = null;
  /** Question of the newest request. */
  #key = "";
  #waiting = 0;
  #frameRequest = 0;
  #speaking = 0;
  /** Point at which a dot was pressed; null when the pointer has left it. */
  #pressed: readonly [number, number] | null = null;

  constructor(host: HTMLElement, session: Session) {
    this.#session = session;
    const { card, signal, store } = session;
    const names = card.controls.map(({ name }) => [name, title(name)] as const);
    this.#across = chooser(names, "", (value) => this.#setAxis("across", value));
    this.#along = chooser(names, "", (value) => this.#setAxis("along", value));
    host.append(
      el(
        "section",
        { class: "map", "aria-label": "Map of two controls" },
        el("h2", {}, "Map"),
        el(
          "div",
          { class: "map-axes" },
          labelled("across", this.#across),
          labelled("up", this.#along),
        ),
        el("div", { class: "map-frame" }, this.#canvas, this.#tip),
        this.#legend.host,
        ...[this.#current, this.#aloud, this.#summary],
        el("details", {}, el("summary", {}, "Sigma as a table"), this.#table),
      ),
    );
    store.listen((_, changed) => this.#update(changed), signal);
    theme.listen(() => this.#redraw(), signal);
    const observer = new ResizeObserver(() => this.#redraw());
    observer.observe(this.#canvas);
    signal.addEventListener("abort", () => {
      observer.disconnect();
      clearTimeout(this.#waiting);
      clearTimeout(this.#speaking);
    });
    this.#listen();
    this.#showAxes();
    this.#request(0);
  }

  get #state(): State {
    return this.#session.store.state;
  }

  /** The controls of the two axes: those of the state, or the first two. */
  get #axes(): [Control, Control] {
    const all = this.#session.card.controls;
    const across = all.find(({ name }) => name === this.#state.across) ?? all[0]!;
    const along =
      all.find((control) => control.name === this.#state.along && control !== across) ??
      all.find((control) => control !== across)!;
    return [across, along];
  }

  get #point(): [number, number] {
    const [across, along] = this.#axes;
    const values = valuesOf(this.#state);
    return [values[across.name]!, values[along.name]!];
  }

  get #frame(): Frame {
    return new Frame(...this.#axes, this.#canvas.clientWidth, this.#canvas.clientHeight);
  }

  get #dots(): Dot[] {
    return clips(this.#session.card, this.#axes, valuesOf(this.#state));
  }

  #update(changed: Changes): void {
    if (has(changed, "across", "along")) this.#showAxes();
    if (!has(changed, "across", "along", "controls", "inferred", "performer", "labels")) return;
    this.#chosen = null;
    this.#describe();
    this.#redraw();
    this.#request(REST);
  }

  #showAxes(): void {
    const [across, along] = this.#axes;
    this.#across.value = across.name;
    this.#along.value = along.name;
  }

  /** Choose a control for an axis; that of the other axis exchanges the two. */
  #setAxis(key: "across" | "along", value: string): void {
    const [across, along] = this.#axes;
    const other = key === "across" ? "along" : "across";
    const now = { across: across.name, along: along.name };
    const left = now[other] === value ? now[key] : now[other];
    this.#session.store.set({ ...now, [other]: left, [key]: value });
  }

  /** Ask for sigma, where the question is another than that of the shown map. */
  #request(rest: number): void {
    const { labels, performer } = this.#state;
    const key = JSON.stringify({
      across: this.#axes[0].name,
      along: this.#axes[1].name,
      columns: COLUMNS,
      rows: ROWS,
      margin: MARGIN,
      controls: others(valuesOf(this.#state), this.#axes),
      performer,
      labels,
    });
    clearTimeout(this.#waiting);
    if (key === this.#key) {
      this.#describe();
      return;
    }
    this.#waiting = window.setTimeout(() => {
      this.#key = key;
      this.#latest.ask(key);
    }, rest);
  }

  async #fetch(key: string): Promise<void> {
    const { service, signal, notice } = this.#session;
    try {
      const grid = await service.client.sigma(this.#state.model, JSON.parse(key), signal);
      if (key === this.#key) this.#show(grid);
    } catch (fault) {
      if (key === this.#key) this.#key = "";
      if (!signal.aborted) notice(fault);
    }
  }

  #show(grid: SigmaGrid): void {
    this.#grid = grid;
    this.#picture = heat(grid);
    this.#veil = veil(grid);
    this.#legend.show(grid, this.#session.card);
    this.#summary.textContent = summary(grid, this.#axes);
    this.#table.replaceChildren(...table(grid, this.#axes));
    this.#redraw();
  }

  #redraw(): void {
    this.#frameRequest ||= requestAnimationFrame(() => {
      this.#frameRequest = 0;
      this.#draw();
    });
  }

  #draw(): void {
    const { clientWidth: width, clientHeight: height } = this.#canvas;
    const ratio = Math.min(2, devicePixelRatio);
    if (!width || this.#session.signal.aborted) return;
    [this.#canvas.width, this.#canvas.height] = [width * ratio, height * ratio];
    const pen = this.#canvas.getContext("2d")!;
    pen.scale(ratio, ratio);
    const axes = this.#axes;
    const fits = this.#grid?.across === axes[0].name && this.#grid.along === axes[1].name;
    draw(pen, {
      frame: this.#frame,
      controls: axes,
      picture: fits ? this.#picture : null,
      veil: fits ? this.#veil : null,
      dots: this.#dots,
      point: this.#point,
      chosen: this.#chosen,
    });
    this.#describe();
  }

  /** Write the current controls and the nearest clip; tell those who move by keys when it rests. */
  #describe(): void {
    const [across, along] = this.#axes;
    const [x, y] = this.#point;
    const where = `${across.name} ${figure(x)} ${across.unit}, ${along.name} ${figure(y)} ${along.unit}`;
    const { index, apart } = nearestTo(this.#session.card, valuesOf(this.#state));
    const near = `nearest example ${this.#name(index)}${apart < 1e-9 ? ", exactly" : ""}`;
    this.#current.textContent = `${where}; ${near}`;
    const label = `Map: ${where}; ${near}. Arrows move, page keys go to examples`;
    this.#canvas.setAttribute("aria-label", label);
    clearTimeout(this.#speaking);
    this.#speaking = window.setTimeout(() => {
      if (document.activeElement === this.#canvas)
        this.#aloud.textContent = this.#current.textContent;
    }, CALM);
  }

  #name(index: number): string {
    return this.#session.card.sources[index] ?? `clip ${index + 1}`;
  }

  #listen(): void {
    const [canvas, { signal }] = [this.#canvas, this.#session];
    const on = <Kind extends keyof HTMLElementEventMap>(
      kind: Kind,
      act: (event: HTMLElementEventMap[Kind]) => void,
    ) => canvas.addEventListener(kind, act, { signal });
    on("pointerdown", (event) => {
      canvas.setPointerCapture(event.pointerId);
      const dot = this.#dotUnder(event);
      this.#pressed = dot && [event.offsetX, event.offsetY];
      if (dot) this.#goToClip(dot.index);
      else this.#set(this.#frame.values(event.offsetX, event.offsetY));
    });
    on("pointermove", (event) => {
      if (event.buttons & 1 && canvas.hasPointerCapture(event.pointerId)) this.#drag(event);
      else this.#choose(this.#dotUnder(event)?.index ?? null);
    });
    on("pointerleave", () => this.#choose(null));
    on("keydown", (event) => this.#press(event));
    on("blur", () => this.#choose(null));
  }

  #drag(event: PointerEvent): void {
    const [x, y] = this.#pressed ?? [Number.NaN, Number.NaN];
    if (Math.hypot(event.offsetX - x, event.offsetY - y) < TREMBLE) return;
    this.#pressed = null;
    this.#set(this.#frame.values(event.offsetX, event.offsetY));
  }

  #set([x, y]: readonly [number, number]): void {
    const [across, along] = this.#axes;
    const controls = { ...this.#state.controls, [across.name]: x, [along.name]: y };
    this.#session.store.set({ controls });
  }

  #dotUnder({ offsetX, offsetY }: PointerEvent): Dot | null {
    const frame = this.#frame;
    const far = ({ at }: Dot) => Math.hypot(frame.x(at[0]) - offsetX, frame.y(at[1]) - offsetY);
    const [first] = this.#dots.filter((dot) => far(dot) < HIT).sort((a, b) => far(a) - far(b));
    return first ?? null;
  }

  /** Mark a captured clip and show its name. */
  #choose(index: number | null): void {
    this.#tip.hidden = index === null;
    if (index === this.#chosen) return;
    this.#chosen = index;
    this.#redraw();
    if (index === null) return;
    const { card } = this.#session;
    const lines = [this.#name(index)];
    const error = card.left_out?.[index];
    if (error !== undefined) lines.push(`left out: ${precise(error)} away`);
    const apart = distance(card, valuesOf(this.#state), index);
    if (apart > 0.02) lines.push(`other controls: ${figure(100 * apart)} % of a range away`);
    this.#tip.replaceChildren(...lines.map((line) => el("div", {}, line)));
    const { at } = this.#dots[index]!;
    const [x, y] = [this.#frame.x(at[0]), this.#frame.y(at[1])];
    this.#tip.style.left = `${Math.min(x + 12, this.#canvas.clientWidth - 190)}px`;
    this.#tip.style.top = `${y + 12}px`;
  }

  /** Go to a captured clip with all of its controls, its performer and its labels. */
  #goToClip(index: number): void {
    const { card, store } = this.#session;
    const values = card.examples[index]!;
    const controls = Object.fromEntries(card.controls.map(({ name }, i) => [name, values[i]!]));
    store.set({ controls, performer: performerOf(card, index), labels: labelsOf(card, index) });
    this.#choose(index);
  }

  #press(event: KeyboardEvent): void {
    const [across, along] = this.#axes;
    const step = event.shiftKey ? 0.1 : 0.02;
    const [x, y] = this.#point;
    const moved = ({ maximum, minimum }: Control, value: number, sign: number) => {
      const size = maximum - minimum;
      const [low, high] = [minimum - MARGIN * size, maximum + MARGIN * size];
      return rounded(Math.min(high, Math.max(low, value + sign * step * size)), size);
    };
    const acts: Record<string, () => void> = {
      ArrowLeft: () => this.#set([moved(across, x, -1), y]),
      ArrowRight: () => this.#set([moved(across, x, 1), y]),
      ArrowDown: () => this.#set([x, moved(along, y, -1)]),
      ArrowUp: () => this.#set([x, moved(along, y, 1)]),
      Home: () => this.#set([across.default, along.default]),
      PageDown: () => this.#stepClip(1),
      PageUp: () => this.#stepClip(-1),
    };
    const act = acts[event.key];
    if (!act || event.ctrlKey || event.metaKey || event.altKey) return;
    event.preventDefault();
    // The page uses some of these keys itself.
    event.stopPropagation();
    act();
  }

  #stepClip(by: number): void {
    const { card } = this.#session;
    const count = card.examples.length;
    const from = this.#chosen ?? nearestTo(card, valuesOf(this.#state)).index;
    this.#goToClip((from + by + count) % count);
  }
}
