/** A body on the stage, as sticks or as a mannequin, solid or as a ghost. */

import type { ModelCard } from "@posefield/client";
import { Group, type Material, MeshLambertMaterial } from "three";

import type { Character } from "./character.ts";
import type { Shown } from "./player.ts";
import { SkinnedBody } from "./skinned-body.ts";
import type { State } from "./state.ts";
import { Stick } from "./stick.ts";
import * as theme from "./theme.ts";

export type Body = State["body"];

/** The names of the colours of skin, sticks and joints among the custom properties. */
const SOLID = { skin: "--body", stick: "--ink", joint: "--accent" } as const;
const GHOST = { skin: "--ghost", stick: "--ghost", joint: "--ghost" } as const;

export class Figure {
  readonly group = new Group();
  readonly #card: ModelCard;
  readonly #character: Character;
  readonly #materials: Readonly<Record<keyof typeof SOLID, MeshLambertMaterial>>;
  readonly #colours: typeof SOLID | typeof GHOST;
  readonly #before: readonly Material[];
  #body: Stick | SkinnedBody | null = null;
  #kind: Body | null = null;
  #shown: Shown | null = null;

  /** opacity: of a ghost. */
  constructor(card: ModelCard, character: Character, ghost: boolean, opacity = 0.32) {
    this.#card = card;
    this.#character = character;
    this.#colours = ghost ? GHOST : SOLID;
    const made = () => (ghost ? pale(opacity) : new MeshLambertMaterial());
    this.#materials = { skin: made(), stick: made(), joint: made() };
    this.#before = ghost ? [hollow()] : [];
    this.tint();
  }

  wear(kind: Body): void {
    if (kind === this.#kind) return;
    this.#kind = kind;
    this.#undress();
    const { skin, stick, joint } = this.#materials;
    this.#body =
      kind === "stick"
        ? new Stick(this.#card, stick, joint)
        : new SkinnedBody(this.#card, this.#character, [...this.#before, skin]);
    this.group.add(this.#body);
    if (this.#shown) this.show(this.#shown);
  }

  show(shown: Shown): void {
    this.#shown = shown;
    this.#body?.show(shown);
    this.group.position.set(shown.carried.x, 0, shown.carried.z);
    this.group.rotation.y = shown.carried.turn;
  }

  tint(): void {
    for (const part of ["skin", "stick", "joint"] as const)
      this.#materials[part].color.set(theme.colour(this.#colours[part]));
  }

  dispose(): void {
    this.#undress();
    this.group.removeFromParent();
    for (const material of [...Object.values(this.#materials), ...this.#before]) material.dispose();
  }

  #undress(): void {
    if (!this.#body) return;
    this.group.remove(this.#body);
    this.#body.dispose();
    this.#body = null;
  }
}

/** Where it coincides with the body, that is what one sees. */
const BEHIND = { polygonOffset: true, polygonOffsetFactor: 6, polygonOffsetUnits: 6 };

function pale(opacity: number): MeshLambertMaterial {
  return new MeshLambertMaterial({ transparent: true, opacity, ...BEHIND });
}

/** Fills the depth alone, so that what is pale shows its outside once and not its inside. */
function hollow(): Material {
  return new MeshLambertMaterial({ colorWrite: false, ...BEHIND });
}
