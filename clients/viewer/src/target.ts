/** A target of the event's joint: dragged on the stage or typed, and met by the service. */

import type { ModelCard, Motion, Trust } from "@posefield/client";
import { Mesh, MeshBasicMaterial, Object3D, SphereGeometry } from "three";
import { TransformControls } from "three/addons/controls/TransformControls.js";

import { el, id, titled } from "./dom.ts";
import { pose, sample } from "./playback.ts";
import type { Session } from "./player.ts";
import { Joints } from "./skeleton.ts";
import { type State, valuesOf } from "./state.ts";
import * as theme from "./theme.ts";
import * as written from "./written.ts";

type Point = NonNullable<State["target"]>;
type CardEvent = NonNullable<ModelCard["event"]>;

const AXES = ["x", "y", "z"] as const;

export function mount(host: HTMLElement, session: Session): void {
  const { cyclic, event } = session.card;
  host.hidden = !event || cyclic;
  if (event && !cyclic) new Target(host, session, event);
}

class Target {
  readonly #session: Session;
  readonly #event: CardEvent;
  readonly #joint: string;
  readonly #handle = new Object3D();
  readonly #ball = new Mesh(new SphereGeometry(0.035, 20, 14), new MeshBasicMaterial());
  readonly #gizmo: TransformControls;
  readonly #miss = el("strong", { "data-miss": "" });
  readonly #fault = el("p", { class: "fault", role: "alert" });
  readonly #fields: readonly HTMLInputElement[];
  /** The time follows the event until the clip comes. */
  #moving = false;

  constructor(host: HTMLElement, session: Session, event: CardEvent) {
    const { card, player, scene, signal, store } = session;
    this.#session = session;
    this.#event = event;
    this.#joint = card.skeleton.names[event.joint]!;
    if (store.state.target) this.#handle.position.set(...store.state.target);
    this.#handle.add(this.#ball);
    this.#gizmo = new TransformControls(scene.camera, scene.renderer.domElement);
    this.#gizmo.setSize(0.55);
    this.#gizmo.attach(this.#handle);
    this.#fields = AXES.map((axis) => this.#field(axis));
    const share = Math.round(100 * event.share);
    const moment = event.share > 0.995 ? " at the end of the clip" : `, ${share} % into the clip`;
    host.append(
      titled("Target", el("span", {}, "misses by ", this.#miss)),
      el(
        "p",
        { class: "about" },
        `Drag the handle on the stage, or type a position for ${this.#joint}${moment}. The controls follow as captured clips near the target have them.`,
      ),
      el(
        "div",
        { class: "point row" },
        ...this.#fields.map((field, i) =>
          el(
            "span",
            { class: "field" },
            el("label", { for: field.id }, AXES[i]!),
            field,
            el("span", { class: "unit" }, "m"),
          ),
        ),
      ),
      this.#fault,
    );
    scene.root.add(this.#handle, this.#gizmo.getHelper());
    this.#gizmo.addEventListener("dragging-changed", ({ value }) => {
      scene.orbit.enabled = !value;
      if (value) this.#begin();
    });
    this.#gizmo.addEventListener("objectChange", () => this.#set());
    this.#gizmo.addEventListener("change", () => scene.redraw());
    // The position of the handle on the stage, px, which tests press.
    scene.add(() => {
      const { clientWidth, clientHeight } = scene.renderer.domElement;
      const { x, y } = this.#handle.position.clone().project(scene.camera);
      const at = [((x + 1) / 2) * clientWidth, ((1 - y) / 2) * clientHeight];
      host.dataset["handle"] = at.map((pixel) => pixel.toFixed(0)).join(" ");
      return false;
    }, signal);
    player.onClip((clip) => {
      this.#moving = false;
      this.#rest(clip);
    });
    player.onTrust((trust) => this.#showMiss(trust));
    const tint = () => this.#ball.material.color.set(theme.colour("--accent"));
    theme.listen(tint, signal);
    tint();
    store.listen((state, changed) => {
      if (changed.has("view")) this.#appear();
      if (changed.has("target") && state.target) this.#handle.position.set(...state.target);
      if (changed.has("target") && player.clip) this.#rest(player.clip);
      if (changed.has("controls") && !changed.has("target")) store.set({ target: null });
    }, signal);
    signal.addEventListener("abort", () => {
      // A drag ends when the model is replaced.
      scene.orbit.enabled = true;
      this.#gizmo.dispose();
      this.#ball.geometry.dispose();
      this.#ball.material.dispose();
      this.#gizmo.getHelper().removeFromParent();
      this.#handle.removeFromParent();
    });
    this.#appear();
  }

  /** Show the moment of the event. */
  #begin(): void {
    const { player, store } = this.#session;
    store.set({ playing: false, time: this.#event.share * player.duration });
  }

  /** Take the handle's position as the target, and leave controls open; those of few values stay. */
  #set(): void {
    const { card, store } = this.#session;
    const { x, y, z } = this.#handle.position;
    const point: Point = [x, y, z];
    const values = valuesOf(store.state);
    const fixed = card.controls.filter((control) => control.values.length > 0);
    this.#moving = true;
    store.set({
      controls: Object.fromEntries(fixed.map(({ name }) => [name, values[name]!])),
      target: point,
    });
    this.#write(point);
  }

  /** Without a target, show the joint's own position. */
  #rest(clip: Motion): void {
    if (this.#session.store.state.target) return;
    const { parents } = this.#session.card.skeleton;
    const now = pose(parents.length);
    sample(now, clip, this.#event.share * clip.trust.duration);
    const joints = new Joints(parents);
    joints.place({ ...clip, rotations: now.rotations, rootPosition: now.root });
    joints.position(this.#event.joint, this.#handle.position);
    this.#write(this.#handle.position.toArray());
    this.#miss.textContent = written.centimetres(0);
  }

  #showMiss({ duration, targets = [] }: Trust): void {
    const { store } = this.#session;
    if (!store.state.target) return;
    if (this.#moving) store.set({ time: this.#event.share * duration });
    const met = targets.find(({ what }) => what === `${this.#joint} at event`);
    if (met) this.#miss.textContent = written.centimetres(met.miss);
  }

  #field(axis: (typeof AXES)[number]): HTMLInputElement {
    const text = { type: "text", inputmode: "decimal", autocomplete: "off", id: id() };
    const field = el("input", { ...text, "data-axis": axis });
    field.addEventListener("change", () => {
      const value = written.read(field.value);
      const wrong = typeof value === "string";
      field.setAttribute("aria-invalid", String(wrong));
      this.#fault.textContent = wrong ? value : "";
      if (wrong) return;
      this.#handle.position.setComponent(AXES.indexOf(axis), value);
      this.#begin();
      this.#set();
    });
    return field;
  }

  #write(point: readonly number[]): void {
    this.#fields.forEach((field, i) => {
      if (document.activeElement !== field || this.#gizmo.dragging)
        field.value = point[i]!.toFixed(3);
    });
  }

  #appear(): void {
    const shown = this.#session.store.state.view === "one";
    this.#handle.visible = this.#gizmo.getHelper().visible = this.#gizmo.enabled = shown;
    this.#session.scene.redraw();
  }
}
