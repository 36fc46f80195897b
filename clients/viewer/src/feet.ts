/** Contacts of feet that the service makes stand: rings on the ground, and the speed of their skate. */

import type { Trust } from "@posefield/client";
import { Group, Mesh, MeshBasicMaterial, RingGeometry } from "three";

import { el, titled } from "./dom.ts";
import type { Session } from "./player.ts";
import { floorOf, whyFeetCannotStand } from "./questions.ts";
import { has } from "./state.ts";
import * as theme from "./theme.ts";

type Stance = NonNullable<Trust["feet"]>["stances"][number];

const ABOUT =
  "Mean speed of standing feet along the ground. Rings: where each foot stands; filled while it does.";

export function mount(host: HTMLElement, session: Session): void {
  const { card, player, scene, signal, store } = session;
  const marks = new Marks();
  const meter = el("strong", { "data-skate": "" });
  const about = el("p", { class: "about" });
  host.append(titled("Feet", el("span", {}, meter)), about);
  scene.root.add(marks.group);
  const show = () => {
    const { feet: wanted, root, view } = store.state;
    const feet = player.clip?.trust.feet;
    const travels = root === card.root;
    host.hidden = !wanted;
    marks.group.visible = wanted && view === "one" && travels;
    const why = whyFeetCannotStand(card);
    if (why) about.textContent = `There are no contacts: ${why}.`;
    else if (!travels)
      about.textContent = "In place, every foot slides: switch root motion on to judge them.";
    else about.textContent = feet ? ABOUT : "Feet as predicted: let them stand to see contacts.";
    meter.textContent = feet && travels ? `${(100 * feet.skate).toFixed(1)} cm/s` : "";
    marks.set(feet && travels ? feet.stances : []);
    fill();
  };
  const fill = () => {
    if (!marks.group.visible) return;
    const { turn, x, z } = player.shown.carried;
    marks.group.position.set(x, floorOf(card, store.state), z);
    marks.group.rotation.y = turn;
    marks.fill(store.state.time, player.duration);
  };
  player.onClip(show);
  player.watch(fill);
  theme.listen(() => marks.tint(), signal);
  store.listen((_, changed) => {
    if (!has(changed, "feet", "root", "view")) return;
    show();
    scene.redraw();
  }, signal);
  signal.addEventListener("abort", () => marks.dispose());
  show();
}

const RING = new RingGeometry(0.052, 0.064, 40).rotateX(-Math.PI / 2);
const DISC = new RingGeometry(0, 0.046, 40).rotateX(-Math.PI / 2);

/** A ring for each stance, with a disc in it while the foot stands. */
class Marks {
  readonly group = new Group();
  readonly #material = new MeshBasicMaterial({ transparent: true, opacity: 0.9 });
  #stances: readonly Stance[] = [];

  constructor() {
    this.tint();
  }

  set(stances: readonly Stance[]): void {
    this.#stances = stances;
    this.group.clear();
    for (const { position } of stances) {
      const ring = new Mesh(RING, this.#material);
      ring.position.set(position[0]!, 0.004, position[2]!);
      ring.add(new Mesh(DISC, this.#material));
      this.group.add(ring);
    }
  }

  fill(time: number, duration: number): void {
    this.#stances.forEach(({ begin, end }, i) => {
      // In a cycle a stance may end in the next lap.
      const stands = (at: number) => begin <= at && at <= end;
      this.group.children[i]!.children[0]!.visible = stands(time) || stands(time + duration);
    });
  }

  dispose(): void {
    this.group.removeFromParent();
    this.#material.dispose();
  }

  tint(): void {
    this.#material.color.set(theme.colour("--accent"));
  }
}
