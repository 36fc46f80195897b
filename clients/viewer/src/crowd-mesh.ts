/**
 * All bones of a crowd as one mesh whose corners are written anew for every frame.
 *
 * Not as instances: software rendering draws each instance by itself, which for thousands of bones
 * costs more than their triangles.
 */

import {
  BufferAttribute,
  BufferGeometry,
  Color,
  DynamicDrawUsage,
  Mesh,
  MeshBasicMaterial,
} from "three";

import { SIZE } from "./rig.ts";

/** Corners of a bone: four at its start and four at its end. */
const CORNERS = 8;
/** Shades of a colour, from that turned away from the light to that turned to it. */
const SHADES = 32;
const SUN = [0.42, 0.78, 0.46] as const;
const SIDES = [0, 1, 5, 0, 5, 4, 1, 2, 6, 1, 6, 5, 2, 3, 7, 2, 7, 6, 3, 0, 4, 3, 4, 7];
// A bone begins within the one before it: only its end is seen.
const FACES = [...SIDES, 4, 5, 6, 4, 6, 7];

export class CrowdMesh {
  readonly mesh: Mesh<BufferGeometry, MeshBasicMaterial>;
  readonly #places: BufferAttribute;
  readonly #colours: BufferAttribute;
  readonly #at: Float32Array;
  readonly #tints: Uint32Array;
  #palette = new Uint32Array();
  #bones = 0;

  constructor(most: number) {
    this.#at = new Float32Array(3 * CORNERS * most);
    const bytes = new Uint8Array(4 * CORNERS * most);
    this.#tints = new Uint32Array(bytes.buffer);
    this.#places = new BufferAttribute(this.#at, 3).setUsage(DynamicDrawUsage);
    this.#colours = new BufferAttribute(bytes, 4, true).setUsage(DynamicDrawUsage);
    const faces = new Uint32Array(FACES.length * most);
    for (let i = 0; i < faces.length; i++) {
      faces[i] = FACES[i % FACES.length]! + CORNERS * Math.floor(i / FACES.length);
    }
    const geometry = new BufferGeometry()
      .setAttribute("position", this.#places)
      .setAttribute("color", this.#colours)
      .setIndex(new BufferAttribute(faces, 1));
    this.mesh = new Mesh(geometry, new MeshBasicMaterial({ vertexColors: true }));
    this.mesh.frustumCulled = false;
  }

  /** Colours of the levels from now on. */
  paint(colours: readonly string[]): void {
    const bytes = new Uint8Array(4 * SHADES * colours.length);
    colours.forEach((colour, level) => {
      for (let shade = 0; shade < SHADES; shade++) {
        const light = 0.32 + (0.9 * shade) / (SHADES - 1);
        const { r, g, b } = new Color(colour).multiplyScalar(light);
        const own = [r, g, b, 1].map((part) => Math.min(255, Math.round(255 * part)));
        bytes.set(own, 4 * (SHADES * level + shade));
      }
    });
    this.#palette = new Uint32Array(bytes.buffer);
  }

  begin(): void {
    this.#bones = 0;
  }

  /** One bone more, as SIZE numbers from a place on, in a level's colour. */
  add(laid: Float32Array, at: number, level: number, taper: number): void {
    for (let corner = 0; corner < 4; corner++) {
      // Corners lie where the x and z axes of a bone point, and opposite.
      const axis = at + (corner & 1 ? 6 : 0);
      const sign = corner & 2 ? -1 : 1;
      const x = sign * laid[axis]!;
      const y = sign * laid[axis + 1]!;
      const z = sign * laid[axis + 2]!;
      const length = Math.sqrt(x * x + y * y + z * z);
      const lit = (x * SUN[0] + y * SUN[1] + z * SUN[2]) / length;
      const tint = this.#palette[SHADES * level + Math.round((SHADES - 1) * (0.5 + 0.5 * lit))]!;
      const first = CORNERS * this.#bones + corner;
      this.#corner(first, laid, at, 1, x, y, z);
      this.#corner(first + 4, laid, at, taper, x, y, z);
      const to = 3 * (first + 4);
      for (let i = 0; i < 3; i++) this.#at[to + i]! += laid[at + 3 + i]!;
      this.#tints[first] = tint;
      this.#tints[first + 4] = tint;
    }
    this.#bones++;
  }

  #corner(
    corner: number,
    laid: Float32Array,
    at: number,
    wide: number,
    x: number,
    y: number,
    z: number,
  ): void {
    const to = 3 * corner;
    this.#at[to] = laid[at + SIZE - 3]! + wide * x;
    this.#at[to + 1] = laid[at + SIZE - 2]! + wide * y;
    this.#at[to + 2] = laid[at + SIZE - 1]! + wide * z;
  }

  /** Only what was written goes to where it is drawn. */
  end(): void {
    this.mesh.geometry.setDrawRange(0, FACES.length * this.#bones);
    sent(this.#places, 3 * CORNERS * this.#bones);
    sent(this.#colours, 4 * CORNERS * this.#bones);
  }

  dispose(): void {
    this.mesh.geometry.dispose();
    this.mesh.material.dispose();
  }
}

function sent(attribute: BufferAttribute, numbers: number): void {
  attribute.clearUpdateRanges();
  attribute.addUpdateRange(0, numbers);
  attribute.needsUpdate = true;
}
