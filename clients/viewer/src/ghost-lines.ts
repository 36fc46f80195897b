/** The finest level's bones as lines, drawn over a coarser one so that the gap shows. */

import type { ModelCard } from "@posefield/client";
import {
  BufferAttribute,
  BufferGeometry,
  LineBasicMaterial,
  LineSegments,
  type Vector3,
} from "three";
import type { Placed } from "./skeleton.ts";
import * as theme from "./theme.ts";

export class Ghost {
  readonly lines: LineSegments<BufferGeometry, LineBasicMaterial>;
  readonly #parents: readonly number[];
  readonly #ends: BufferAttribute;

  constructor(card: ModelCard, shown: boolean) {
    this.#parents = card.skeleton.parents;
    this.#ends = new BufferAttribute(new Float32Array(6 * this.#parents.length), 3);
    const geometry = new BufferGeometry().setAttribute("position", this.#ends);
    const material = new LineBasicMaterial({ depthTest: false, transparent: true, opacity: 0.9 });
    this.lines = new LineSegments(geometry, material);
    this.lines.frustumCulled = false;
    this.lines.renderOrder = 1;
    this.lines.visible = shown;
  }

  paint(): void {
    this.lines.material.color.set(theme.colour("--ink"));
  }

  dispose(): void {
    this.lines.geometry.dispose();
    this.lines.material.dispose();
  }

  place({ positions }: Placed, shift: Vector3): void {
    if (!this.lines.visible) return;
    this.lines.position.copy(shift);
    const out = this.#ends.array;
    this.#parents.forEach((parent, joint) => {
      for (let i = 0; i < 3; i++) {
        out[6 * joint + i] = positions[3 * Math.max(0, parent) + i]!;
        out[6 * joint + 3 + i] = positions[3 * joint + i]!;
      }
    });
    this.#ends.needsUpdate = true;
  }
}
