/**
 * A crowd drawn in two calls: who is near with all triangles of the skin, who is far with few.
 *
 * The graphics card moves the skins by matrices of the joints, which are written to a texture for
 * every frame. Not as instances: software rendering draws each instance by itself, half as fast as
 * one mesh of them all.
 */

import {
  BufferAttribute,
  BufferGeometry,
  Color,
  DataTexture,
  FloatType,
  Group,
  Mesh,
  RGBAFormat,
  ShaderMaterial,
} from "three";

import type { Character } from "./character.ts";
import type { Library } from "./crowd-library.ts";
import type { Crowd } from "./crowd-walk.ts";

/** Numbers of a joint's matrix: three rows of four. */
export const SIZE = 12;
/** Most characters that have all triangles. */
export const NEAREST = 64;
/** Texels of a row of a texture. */
export const WIDE = 1024;
export const MOST_LEVELS = 8;

/** What draws a crowd. */
export interface CrowdDrawing {
  readonly group: Group;
  /** Colours of the levels from now on. */
  paint(colours: readonly string[]): void;
  begin(): void;
  /** One character more: number `i` of a crowd, near or far. */
  add(near: boolean, crowd: Crowd, i: number): void;
  end(): void;
  dispose(): void;
}

/** A colour in the light that falls on a skin, by where it faces. */
export const LIT = `
vec3 lit(vec3 facing, vec3 colour) {
  float share = 0.5 + 0.5 * dot(normalize(facing), vec3(0.42, 0.78, 0.46));
  return min(vec3(1.0), colour * (0.32 + 0.9 * share));
}`;

const VERTEX = `
attribute vec4 skinIndex;
attribute vec4 skinWeight;
uniform highp sampler2D crowd;
uniform int texels;
uniform vec3 tints[${MOST_LEVELS}];
varying vec3 tint;
vec4 texel(int at) { return texelFetch(crowd, ivec2(at % ${WIDE}, at / ${WIDE}), 0); }
${LIT}
void main() {
  int own = gl_VertexID / POINTS * texels;
  vec4 rest = vec4(position, 1.0);
  vec3 place = vec3(0.0);
  vec3 facing = vec3(0.0);
  float whole = 0.0;
  for (int i = 0; i < INFLUENCES; i++) {
    float weight = skinWeight[i];
    if (weight == 0.0) break;
    int at = own + 3 * int(skinIndex[i]);
    vec4 x = texel(at);
    vec4 y = texel(at + 1);
    vec4 z = texel(at + 2);
    place += weight * vec3(dot(x, rest), dot(y, rest), dot(z, rest));
    facing += weight * vec3(dot(x.xyz, normal), dot(y.xyz, normal), dot(z.xyz, normal));
    whole += weight;
  }
  int level = int(texel(own + texels - 1).x);
  tint = lit(facing, tints[level]);
  gl_Position = projectionMatrix * viewMatrix * vec4(place / whole, 1.0);
}`;
export const FRAGMENT = `
varying vec3 tint;
void main() {
  gl_FragColor = vec4(tint, 1.0);
  #include <colorspace_fragment>
}`;

/** Characters of one skin. */
class Part {
  readonly mesh: Mesh<BufferGeometry, ShaderMaterial>;
  readonly #corners: number;
  readonly #numbers: Float32Array;
  readonly #texture: DataTexture;
  /** Numbers of a character: its joints' matrices, and four for its level. */
  readonly #size: number;
  #count = 0;

  /** corners: of the triangles; influences: how many joints move a point. */
  constructor(
    character: Character,
    corners: Character["fine"],
    joints: number,
    most: number,
    influences: number,
    tints: Color[],
  ) {
    const used = [...new Set(corners)].sort((a, b) => a - b);
    this.#corners = corners.length;
    this.#size = SIZE * joints + 4;
    const high = Math.ceil((most * this.#size) / (4 * WIDE));
    this.#numbers = new Float32Array(4 * WIDE * high);
    this.#texture = new DataTexture(this.#numbers, WIDE, high, RGBAFormat, FloatType);
    const material = new ShaderMaterial({
      vertexShader: VERTEX,
      fragmentShader: FRAGMENT,
      defines: { INFLUENCES: influences, POINTS: used.length },
      uniforms: {
        crowd: { value: this.#texture },
        texels: { value: this.#size / 4 },
        tints: { value: tints },
      },
    });
    this.mesh = new Mesh(repeated(character, corners, used, most), material);
    this.mesh.frustumCulled = false;
  }

  get count(): number {
    return this.#count;
  }

  begin(): void {
    this.#count = 0;
  }

  /** Room for the matrices of one character more. */
  add(level: number): Float32Array {
    const start = this.#size * this.#count;
    this.#count++;
    this.#numbers[start + this.#size - 4] = Math.min(level, MOST_LEVELS - 1);
    return this.#numbers.subarray(start, start + this.#size - 4);
  }

  end(): void {
    this.mesh.visible = this.#count > 0;
    this.mesh.geometry.setDrawRange(0, this.#corners * this.#count);
    this.#texture.needsUpdate = true;
  }

  dispose(): void {
    this.mesh.geometry.dispose();
    this.mesh.material.dispose();
    this.#texture.dispose();
  }
}

export class CrowdMesh implements CrowdDrawing {
  readonly group = new Group();
  readonly #near: Part;
  readonly #far: Part;
  readonly #tints = Array.from({ length: MOST_LEVELS }, () => new Color());
  readonly #library: Library;

  /** most: characters. */
  constructor(character: Character, library: Library, joints: number, most: number) {
    this.#library = library;
    this.#near = new Part(character, character.fine, joints, NEAREST, 4, this.#tints);
    this.#far = new Part(character, character.coarse, joints, most, 1, this.#tints);
    this.group.add(this.#near.mesh, this.#far.mesh);
  }

  paint(colours: readonly string[]): void {
    colours.forEach((colour, level) => void this.#tints[level]?.set(colour));
  }

  begin(): void {
    for (const part of [this.#near, this.#far]) part.begin();
  }

  add(near: boolean, crowd: Crowd, i: number): void {
    const part = near && this.#near.count < NEAREST ? this.#near : this.#far;
    crowd.lay(part.add(crowd.level[i]!), this.#library, i);
  }

  end(): void {
    for (const part of [this.#near, this.#far]) part.end();
  }

  dispose(): void {
    for (const part of [this.#near, this.#far]) part.dispose();
  }
}

/** The same skin again and again, with those points that its triangles use. */
function repeated(
  { points, normals, joints, weights }: Character,
  corners: Character["fine"],
  used: readonly number[],
  most: number,
): BufferGeometry {
  const place = new Map(used.map((point, at) => [point, at]));
  const count = used.length;
  const index = new Uint32Array(corners.length * most);
  for (let i = 0; i < index.length; i++) {
    index[i] = place.get(corners[i % corners.length]!)! + count * Math.floor(i / corners.length);
  }
  const attribute = (own: Float32Array | Uint8Array | Uint16Array, width: number, unit = false) => {
    const all = new (own.constructor as typeof Float32Array)(width * count * most);
    used.forEach((point, at) => {
      all.set(own.subarray(width * point, width * (point + 1)), width * at);
    });
    for (let i = 1; i < most; i++) all.copyWithin(width * count * i, 0, width * count);
    return new BufferAttribute(all, width, unit);
  };
  return new BufferGeometry()
    .setAttribute("position", attribute(points, 3))
    .setAttribute("normal", attribute(normals, 3))
    .setAttribute("skinIndex", attribute(joints, 4))
    .setAttribute("skinWeight", attribute(weights, 4, true))
    .setIndex(new BufferAttribute(index, 1));
}
