/**
 * A crowd of up to ten thousand, drawn as instances: the motions lie in a texture, each character is
 * six numbers a frame, and the graphics card mixes frames and moves the skin.
 */

import {
  type BufferAttribute,
  Color,
  DataTexture,
  DynamicDrawUsage,
  FloatType,
  Group,
  InstancedBufferAttribute,
  InstancedBufferGeometry,
  Mesh,
  RGBAFormat,
  ShaderMaterial,
} from "three";

import { type Character, geometry } from "./character.ts";
import { FRAMES, type Library } from "./crowd-library.ts";
import { type CrowdDrawing, FRAGMENT, LIT, MOST_LEVELS, SIZE, WIDE } from "./crowd-mesh.ts";
import type { Crowd } from "./crowd-walk.ts";

const VERTEX = `
attribute vec4 skinIndex;
attribute vec4 skinWeight;
/** x, z, heading and phase; motion at a level, and the level. */
attribute vec4 standing;
attribute vec2 motion;
uniform highp sampler2D poses;
uniform vec3 tints[${MOST_LEVELS}];
varying vec3 tint;
vec4 texel(int at) { return texelFetch(poses, ivec2(at % ${WIDE}, at / ${WIDE}), 0); }
${LIT}
void main() {
  float frames = standing.w * float(${FRAMES});
  int frame = min(${FRAMES - 1}, int(frames));
  float share = frames - float(frame);
  int own = (int(motion.x) * ${FRAMES + 1} + frame) * TEXELS;
  vec4 rest = vec4(position, 1.0);
  vec3 place = vec3(0.0);
  vec3 facing = vec3(0.0);
  float whole = 0.0;
  for (int i = 0; i < INFLUENCES; i++) {
    float weight = skinWeight[i];
    if (weight == 0.0) break;
    int at = own + 3 * int(skinIndex[i]);
    vec4 x = mix(texel(at), texel(at + TEXELS), share);
    vec4 y = mix(texel(at + 1), texel(at + 1 + TEXELS), share);
    vec4 z = mix(texel(at + 2), texel(at + 2 + TEXELS), share);
    place += weight * vec3(dot(x, rest), dot(y, rest), dot(z, rest));
    facing += weight * vec3(dot(x.xyz, normal), dot(y.xyz, normal), dot(z.xyz, normal));
    whole += weight;
  }
  float c = cos(standing.z);
  float s = sin(standing.z);
  mat3 turn = mat3(c, 0.0, -s, 0.0, 1.0, 0.0, s, 0.0, c);
  place = turn * (place / whole) + vec3(standing.x, 0.0, standing.y);
  tint = lit(turn * facing, tints[int(motion.y)]);
  gl_Position = projectionMatrix * viewMatrix * vec4(place, 1.0);
}`;

/** Characters of one skin. */
class Part {
  readonly mesh: Mesh<InstancedBufferGeometry, ShaderMaterial>;
  readonly #standing: InstancedBufferAttribute;
  readonly #motion: InstancedBufferAttribute;
  #count = 0;

  constructor(geometry: InstancedBufferGeometry, material: ShaderMaterial, most: number) {
    this.#standing = new InstancedBufferAttribute(new Float32Array(4 * most), 4);
    this.#motion = new InstancedBufferAttribute(new Float32Array(2 * most), 2);
    geometry.setAttribute("standing", this.#standing.setUsage(DynamicDrawUsage));
    geometry.setAttribute("motion", this.#motion.setUsage(DynamicDrawUsage));
    this.mesh = new Mesh(geometry, material);
    this.mesh.frustumCulled = false;
  }

  begin(): void {
    this.#count = 0;
  }

  add(crowd: Crowd, i: number): void {
    crowd.stand(this.#standing.array, this.#motion.array, this.#count, i);
    this.#count++;
  }

  end(): void {
    this.mesh.visible = this.#count > 0;
    this.mesh.geometry.instanceCount = this.#count;
    for (const own of [this.#standing, this.#motion]) {
      own.clearUpdateRanges();
      own.addUpdateRange(0, own.itemSize * this.#count);
      own.needsUpdate = true;
    }
  }

  dispose(): void {
    this.mesh.geometry.dispose();
    this.mesh.material.dispose();
  }
}

export class BakedCrowd implements CrowdDrawing {
  readonly group = new Group();
  readonly #near: Part;
  readonly #far: Part;
  readonly #texture: DataTexture;
  readonly #tints = Array.from({ length: MOST_LEVELS }, () => new Color());

  /** most: characters. */
  constructor(character: Character, library: Library, joints: number, most: number) {
    const numbers = new Float32Array(4 * WIDE * Math.ceil(library.poses.length / (4 * WIDE)));
    numbers.set(library.poses);
    const high = numbers.length / (4 * WIDE);
    this.#texture = new DataTexture(numbers, WIDE, high, RGBAFormat, FloatType);
    this.#texture.needsUpdate = true;
    const part = (corners: Character["fine"], influences: number) => {
      const uniforms = { poses: { value: this.#texture }, tints: { value: this.#tints } };
      const defines = { INFLUENCES: influences, TEXELS: (SIZE * joints) / 4 };
      const material = new ShaderMaterial({
        vertexShader: VERTEX,
        fragmentShader: FRAGMENT,
        defines,
        uniforms,
      });
      return new Part(instanced(character, corners), material, most);
    };
    this.#near = part(character.fine, 4);
    this.#far = part(character.coarse, 1);
    this.group.add(this.#near.mesh, this.#far.mesh);
  }

  paint(colours: readonly string[]): void {
    colours.forEach((colour, level) => void this.#tints[level]?.set(colour));
  }

  begin(): void {
    for (const part of [this.#near, this.#far]) part.begin();
  }

  add(near: boolean, crowd: Crowd, i: number): void {
    (near ? this.#near : this.#far).add(crowd, i);
  }

  end(): void {
    for (const part of [this.#near, this.#far]) part.end();
  }

  dispose(): void {
    for (const part of [this.#near, this.#far]) part.dispose();
    this.#texture.dispose();
  }
}

function instanced(character: Character, corners: Character["fine"]): InstancedBufferGeometry {
  const plain = geometry(character, corners);
  const found = new InstancedBufferGeometry();
  for (const [name, own] of Object.entries(plain.attributes)) {
    found.setAttribute(name, own as BufferAttribute);
  }
  return found.setIndex(plain.index);
}
