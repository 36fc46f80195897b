/** A point in space that a joint shall reach: drag it, and the controls follow. */

import { Mesh, MeshBasicMaterial, Object3D, SphereGeometry } from "three";
import { TransformControls } from "three/addons/controls/TransformControls.js";

import { el, id } from "./dom.ts";
import { Latest } from "./latest.ts";
import { Reach } from "./reach.ts";
import type { CardEvent, Session } from "./session.ts";
import type { Point } from "./solve.ts";
import * as theme from "./theme.ts";
import * as written from "./written.ts";

export function mount(host: HTMLElement, session: Session): void {
  const { event: found } = session.card;
  host.hidden = !found || session.card.cyclic;
  if (found && !session.card.cyclic) new Target(host, session, found);
}

const AXES = ["x", "y", "z"] as const;

class Target {
  readonly #session: Session;
  readonly #reach: Reach;
  readonly #handle = new Object3D();
  readonly #ball: Mesh<SphereGeometry, MeshBasicMaterial>;
  readonly #gizmo: TransformControls;
  readonly #miss = el("strong", { "data-miss": "" });
  readonly #fault = el("p", { class: "fault", role: "alert" });
  readonly #fields: readonly HTMLInputElement[];
  readonly #ask = new Latest<Point>((point) => this.#follow(point));
  /** Wanted, while somebody drags or has typed; else the handle follows the joint. */
  #wanted: Point | null = null;

  constructor(host: HTMLElement, session: Session, found: CardEvent) {
    const { card, player, scene, signal, store } = session;
    this.#session = session;
    this.#wanted = store.state.target;
    if (this.#wanted) this.#handle.position.set(...this.#wanted);
    this.#reach = new Reach(session, found);
    this.#ball = new Mesh(new SphereGeometry(0.035, 20, 14), new MeshBasicMaterial());
    this.#handle.add(this.#ball);
    this.#gizmo = new TransformControls(scene.camera, scene.renderer.domElement);
    this.#gizmo.setSize(0.55);
    this.#gizmo.attach(this.#handle);
    this.#fields = AXES.map((axis) => this.#field(axis));
    const joint = card.skeleton.names[found.joint]!;
    host.append(
      el(
        "div",
        { class: "title" },
        el("h2", {}, "Target"),
        el("span", {}, "misses by ", this.#miss),
      ),
      el(
        "p",
        { class: "about" },
        `Drag the handle on the stage, or type a position for ${joint}${moment(found.share)}. The controls follow within their sampled ranges.`,
      ),
      el("div", { class: "point" }, ...this.#fields.map((field, i) => labelled(AXES[i]!, field))),
      this.#fault,
    );
    scene.root.add(this.#handle, this.#gizmo.getHelper());
    const stop = scene.add(() => this.#tell(host));
    this.#listen();
    player.onClip(() => this.#rest());
    theme.listen(() => this.#tint(), signal);
    this.#tint();
    const leave = store.listen((_, changed) => {
      if (changed.has("view")) this.#appear();
      if (changed.has("target")) this.#restore(store.state.target);
      if (changed.has("controls") && !changed.has("target") && !this.#reach.taking)
        store.set({ target: null });
    });
    signal.addEventListener("abort", () => {
      leave();
      stop();
      // Who drags while the model is replaced has let go of it.
      scene.orbit.enabled = true;
      this.#gizmo.dispose();
      this.#ball.geometry.dispose();
      this.#ball.material.dispose();
      this.#gizmo.getHelper().removeFromParent();
      this.#handle.removeFromParent();
    });
    this.#appear();
  }

  #listen(): void {
    const { scene } = this.#session;
    const gizmo = this.#gizmo;
    gizmo.addEventListener("dragging-changed", ({ value }) => {
      scene.orbit.enabled = !value;
      if (value) this.#reach.begin();
    });
    gizmo.addEventListener("objectChange", () => {
      const { x, y, z } = this.#handle.position;
      this.#want([x, y, z]);
    });
    gizmo.addEventListener("change", () => scene.redraw());
  }

  #want(point: Point): void {
    this.#wanted = point;
    this.#session.store.set({ target: point });
    this.#write(point);
    this.#ask.ask(point);
  }

  /** A target that another part or the address has set or taken away. */
  #restore(target: Point | null): void {
    if (target === this.#wanted) return;
    this.#wanted = target;
    if (target) this.#handle.position.set(...target);
    this.#rest();
  }

  async #follow(point: Point): Promise<void> {
    const { notice, signal } = this.#session;
    try {
      for await (const miss of this.#reach.towards(point, () => this.#wanted === point)) {
        if (signal.aborted) return;
        this.#miss.textContent = written.centimetres(miss);
      }
    } catch (fault) {
      if (!signal.aborted) notice(fault);
    }
  }

  /** Where the joint is, when nobody wants it elsewhere. */
  #rest(): void {
    const { clip } = this.#session.player;
    if (!clip) return;
    const at = this.#reach.reached(clip);
    if (this.#wanted) {
      const [x, y, z] = this.#wanted;
      this.#miss.textContent = written.centimetres(Math.hypot(at[0] - x, at[1] - y, at[2] - z));
      return;
    }
    this.#handle.position.set(...at);
    this.#write(at);
    this.#miss.textContent = written.centimetres(0);
  }

  #field(axis: (typeof AXES)[number]): HTMLInputElement {
    const field = el("input", {
      type: "text",
      inputmode: "decimal",
      autocomplete: "off",
      id: id(),
    });
    field.dataset["axis"] = axis;
    field.addEventListener("change", () => this.#typed(field));
    return field;
  }

  #typed(field: HTMLInputElement): void {
    const found = written.read(field.value);
    const wrong = typeof found === "string";
    field.setAttribute("aria-invalid", String(wrong));
    this.#fault.textContent = wrong ? found : "";
    if (wrong) return;
    const axis = this.#fields.indexOf(field);
    this.#handle.position.setComponent(axis, found);
    const { x, y, z } = this.#handle.position;
    this.#reach.begin();
    this.#want([x, y, z]);
  }

  #write(point: Point): void {
    this.#fields.forEach((field, i) => {
      if (document.activeElement !== field || this.#gizmo.dragging)
        field.value = point[i]!.toFixed(3);
    });
  }

  /** Where on the stage the handle is drawn, px: for those who press there without eyes. */
  #tell(host: HTMLElement): boolean {
    const { camera, renderer } = this.#session.scene;
    const { clientWidth, clientHeight } = renderer.domElement;
    const { x, y } = this.#handle.position.clone().project(camera);
    const at = [((x + 1) / 2) * clientWidth, ((1 - y) / 2) * clientHeight];
    host.dataset["handle"] = at.map((pixel) => pixel.toFixed(0)).join(" ");
    return false;
  }

  #appear(): void {
    const shown = this.#session.store.state.view === "one";
    this.#handle.visible = this.#gizmo.getHelper().visible = this.#gizmo.enabled = shown;
    this.#session.scene.redraw();
  }

  #tint(): void {
    this.#ball.material.color.set(theme.colour("--accent"));
  }
}

/** When the event is, in words. */
function moment(share: number): string {
  return share > 0.995 ? " at the end of the clip" : `, ${Math.round(100 * share)} % into the clip`;
}

function labelled(axis: string, field: HTMLInputElement): HTMLElement {
  return el(
    "span",
    { class: "field" },
    el("label", { for: field.id }, axis),
    field,
    el("span", { class: "unit" }, "m"),
  );
}
