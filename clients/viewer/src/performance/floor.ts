/** The path on the floor: where the body goes, the points of walks, targets and obstacles. */

import { Group, Plane, Raycaster, Vector2, Vector3 } from "three";

import { button, el, toggle } from "../dom.ts";
import * as theme from "../theme.ts";
import type { Desk } from "./desk.ts";
import { clear, discs, lines, targets } from "./floor-shapes.ts";
import { rounded } from "./path-fields.ts";
import { type FloorPoint, points, put, through } from "./script.ts";
import { segmentOf, within } from "./timeline.ts";

/** How near to a point one presses to take hold of it, px, and how far a click may stray. */
const [NEAR, STRAY] = [16, 5];

export function mount(host: HTMLElement, desk: Desk): void {
  const floor = new Floor(host, desk);
  desk.listen((change) => {
    if (change !== "time") floor.draw();
  });
  theme.listen(() => floor.draw(), desk.session.signal);
}

class Floor {
  readonly #desk: Desk;
  readonly #host: HTMLElement;
  readonly #group = new Group();
  readonly #draw: ReturnType<typeof toggle>;
  readonly #hint = el("p", { class: "floor-hint", role: "status" });
  #drawing = false;
  /** Index of the point that is dragged. */
  #held: number | null = null;
  #pressed: readonly [number, number] | null = null;

  constructor(host: HTMLElement, desk: Desk) {
    this.#desk = desk;
    this.#host = host;
    const { scene, signal } = desk.session;
    this.#draw = toggle("Draw path", "Draw path of the chosen walk: click on the floor", (on) =>
      this.#begin(on),
    );
    const above = button("From above", "From above: show the whole path", () => this.#above());
    const follow = toggle("Follow", "Follow the body with the camera", (on) => {
      desk.follows = on;
      follow.set(on);
      desk.seek(desk.time);
    });
    follow.set(true);
    this.#follow = follow;
    host.append(el("div", { class: "floor-tools" }, this.#draw, above, follow), this.#hint);
    scene.root.add(this.#group);
    const canvas = scene.renderer.domElement;
    // Before the camera's own, which would turn with it.
    canvas.addEventListener("pointerdown", (event) => this.#down(event), { signal, capture: true });
    canvas.addEventListener("pointermove", (event) => this.#move(event), { signal });
    canvas.addEventListener("pointerup", (event) => this.#up(event), { signal });
    canvas.addEventListener("pointercancel", () => this.#let(), { signal });
    document.addEventListener(
      "keydown",
      ({ key }) => {
        if (key === "Escape" && this.#drawing) this.#begin(false);
      },
      { signal },
    );
    const stop = scene.add(() => this.#tell());
    signal.addEventListener("abort", () => {
      stop();
      this.#let();
      clear(this.#group);
      this.#group.removeFromParent();
    });
  }

  readonly #follow: ReturnType<typeof toggle>;

  draw(): void {
    const { performed, script, segment, selected, session, shown } = this.#desk;
    clear(this.#group);
    this.#group.visible = shown;
    const walk = segment?.kind === "walk";
    this.#draw.disabled = !walk;
    if (!walk && this.#drawing) this.#begin(false);
    if (shown && script) {
      if (performed) this.#group.add(...lines(performed, selected));
      this.#group.add(...discs(script, selected, this.#wrong()), ...targets(script));
    }
    session.scene.redraw();
  }

  /** Indices of the chosen walk's points at which it was refused. */
  #wrong(): ReadonlySet<number> {
    const { notes, selected } = this.#desk;
    const found = notes.filter(({ fault, pointer }) => fault && segmentOf(pointer) === selected);
    const places = found.map(({ pointer }) => /^(?:along\/(\d+)|to)/.exec(within(pointer)));
    return new Set(places.flatMap((place) => (place ? [Number(place[1] ?? 0)] : [])));
  }

  #begin(on: boolean): void {
    this.#drawing = on;
    this.#draw.set(on);
    this.#hint.textContent = on ? HINT : "";
    this.#desk.session.scene.renderer.domElement.style.cursor = on ? "crosshair" : "";
    if (on) this.#above();
  }

  #above(): void {
    const { performed, script, session } = this.#desk;
    this.#desk.follows = false;
    this.#follow.set(false);
    const places = (script?.segments ?? []).flatMap((segment) => [...points(segment)]);
    const roots = performed?.track.rootPosition ?? [];
    for (let at = 0; at < roots.length; at += 30) places.push([roots[at]!, roots[at + 2]!]);
    places.push([0, 0]);
    const [xs, zs] = [places.map(([x]) => x), places.map(([, z]) => z)];
    const [left, right] = [Math.min(...xs), Math.max(...xs)];
    const [near, far] = [Math.min(...zs), Math.max(...zs)];
    session.scene.above(
      (left + right) / 2,
      (near + far) / 2,
      2 + Math.max(right - left, far - near),
    );
  }

  #down(event: PointerEvent): void {
    if (!this.#desk.shown || event.button !== 0) return;
    this.#pressed = [event.clientX, event.clientY];
    this.#held = this.#nearest(event);
    if (this.#held === null) return;
    this.#desk.session.scene.orbit.enabled = false;
    this.#desk.session.scene.renderer.domElement.setPointerCapture(event.pointerId);
    this.#desk.drag(true);
  }

  #move(event: PointerEvent): void {
    if (this.#held === null) return;
    const at = this.#at(event);
    const { segment } = this.#desk;
    if (!at || segment?.kind !== "walk") return;
    this.#desk.change(through(segment, points(segment).with(this.#held, at)));
  }

  #up(event: PointerEvent): void {
    const pressed = this.#pressed;
    if (this.#held !== null) {
      this.#let();
      return;
    }
    this.#pressed = null;
    if (!pressed || !this.#drawing) return;
    if (Math.hypot(event.clientX - pressed[0], event.clientY - pressed[1]) > STRAY) return;
    const at = this.#at(event);
    const { segment } = this.#desk;
    if (!at || segment?.kind !== "walk") return;
    // A walk to a point, and one without, becomes one along points.
    const bare = put(segment, "to", undefined);
    this.#desk.change(through(bare, [...points(segment), at]));
  }

  #let(): void {
    this.#pressed = null;
    if (this.#held === null) return;
    this.#held = null;
    this.#desk.session.scene.orbit.enabled = true;
    this.#desk.drag(false);
  }

  /** Index of the chosen walk's point under the pointer. */
  #nearest(event: PointerEvent): number | null {
    const box = this.#desk.session.scene.renderer.domElement.getBoundingClientRect();
    const away = this.#seen().map(([x, y]) =>
      Math.hypot(event.clientX - box.left - x, event.clientY - box.top - y),
    );
    const least = Math.min(...away);
    return least <= NEAR ? away.indexOf(least) : null;
  }

  /** Where on the floor the pointer is; null above the horizon. */
  #at(event: PointerEvent): FloorPoint | null {
    const { camera, renderer } = this.#desk.session.scene;
    const box = renderer.domElement.getBoundingClientRect();
    const x = (2 * (event.clientX - box.left)) / box.width - 1;
    const y = 1 - (2 * (event.clientY - box.top)) / box.height;
    const ray = new Raycaster();
    ray.setFromCamera(new Vector2(x, y), camera);
    const found = ray.ray.intersectPlane(new Plane(new Vector3(0, 1, 0), 0), new Vector3());
    return found && [rounded(found.x), rounded(found.z)];
  }

  /** Points of the chosen walk on the stage, px. */
  #seen(): (readonly [number, number])[] {
    const { camera, renderer } = this.#desk.session.scene;
    const { clientWidth, clientHeight } = renderer.domElement;
    return points(this.#desk.segment).map(([x, z]) => {
      const { x: across, y: up } = new Vector3(x, 0, z).project(camera);
      return [((across + 1) / 2) * clientWidth, ((1 - up) / 2) * clientHeight] as const;
    });
  }

  /** Where they are drawn, for who tests the page. */
  #tell(): boolean {
    if (!this.#desk.shown) return false;
    const seen = this.#seen().map((place) => place.map((pixel) => pixel.toFixed(0)).join(","));
    this.#host.dataset["points"] = seen.join(" ");
    return false;
  }
}

const HINT = "Click on the floor to add a point at the end of the path; drag a point to move it.";
