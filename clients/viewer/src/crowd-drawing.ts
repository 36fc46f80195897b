/**
 * A crowd of up to ten thousand, drawn as instances: the motions lie in a texture, each character is
 * six numbers a frame, and the graphics card interpolates frames and moves the skin.
 */

import {
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
import { type Crowd, FRAMES, type Motions, SIZE } from "./crowd-motions.ts";

/** Texels of a row of the texture. */
const WIDE = 1024;
const MOST_LEVELS = 8;

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
void main() {
  float frames = standing.w * float(${FRAMES});
  int frame = min(${FRAMES - 1}, int(frames));
  float share = frames - float(frame);
  int first = (int(motion.x) * ${FRAMES + 1} + frame) * TEXELS;
  vec4 rest = vec4(position, 1.0);
  vec3 place = vec3(0.0);
  vec3 facing = vec3(0.0);
  float whole = 0.0;
  for (int i = 0; i < INFLUENCES; i++) {
    float weight = skinWeight[i];
    if (weight == 0.0) break;
    int at = first + 3 * int(skinIndex[i]);
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
  float light = 0.5 + 0.5 * dot(normalize(turn * facing), vec3(0.42, 0.78, 0.46));
  tint = min(vec3(1.0), tints[int(motion.y)] * (0.32 + 0.9 * light));
  gl_Position = projectionMatrix * viewMatrix * vec4(place, 1.0);
}`;
const FRAGMENT = `
varying vec3 tint;
void main() {
  gl_FragColor = vec4(tint, 1.0);
  #include <colorspace_fragment>
}`;

export class CrowdDrawing {
  readonly group = new Group();
  readonly #near: Part;
  readonly #far: Part;
  readonly #texture: DataTexture;
  readonly #tints = Array.from({ length: MOST_LEVELS }, () => new Color());

  /** most: characters. */
  constructor(character: Character, { poses }: Motions, joints: number, most: number) {
    const high = Math.ceil(poses.length / (4 * WIDE));
    const numbers = new Float32Array(4 * WIDE * high);
    numbers.set(poses);
    this.#texture = new DataTexture(numbers, WIDE, high, RGBAFormat, FloatType);
    this.#texture.needsUpdate = true;
    const part = (corners: Character["fine"], influences: number) => {
      const material = new ShaderMaterial({
        vertexShader: VERTEX,
        fragmentShader: FRAGMENT,
        defines: { INFLUENCES: influences, TEXELS: (SIZE * joints) / 4 },
        uniforms: { poses: { value: this.#texture }, tints: { value: this.#tints } },
      });
      return new Part(character, corners, material, most);
    };
    this.#near = part(character.fine, 4);
    this.#far = part(character.coarse, 1);
    this.group.add(this.#near.mesh, this.#far.mesh);
  }

  /** Set the colours of the levels. */
  tint(colours: readonly string[]): void {
    colours.forEach((colour, level) => void this.#tints[level]?.set(colour));
  }

  /** Draw these characters, each near or far. */
  draw(crowd: Crowd, characters: Iterable<readonly [index: number, near: boolean]>): void {
    this.#near.count = this.#far.count = 0;
    for (const [index, near] of characters) (near ? this.#near : this.#far).add(crowd, index);
    this.#near.upload();
    this.#far.upload();
  }

  dispose(): void {
    for (const { mesh } of [this.#near, this.#far]) {
      mesh.geometry.dispose();
      mesh.material.dispose();
    }
    this.#texture.dispose();
    this.group.removeFromParent();
  }
}

/** Characters that are drawn with the same triangles. */
class Part {
  readonly mesh: Mesh<InstancedBufferGeometry, ShaderMaterial>;
  count = 0;
  readonly #standing: InstancedBufferAttribute;
  readonly #motion: InstancedBufferAttribute;

  constructor(
    character: Character,
    corners: Character["fine"],
    material: ShaderMaterial,
    most: number,
  ) {
    const skin = geometry(character, corners);
    const instances = new InstancedBufferGeometry().setIndex(skin.index);
    for (const [name, attribute] of Object.entries(skin.attributes))
      instances.setAttribute(name, attribute);
    this.#standing = new InstancedBufferAttribute(new Float32Array(4 * most), 4);
    this.#motion = new InstancedBufferAttribute(new Float32Array(2 * most), 2);
    instances.setAttribute("standing", this.#standing.setUsage(DynamicDrawUsage));
    instances.setAttribute("motion", this.#motion.setUsage(DynamicDrawUsage));
    this.mesh = new Mesh(instances, material);
    this.mesh.frustumCulled = false;
  }

  add(crowd: Crowd, index: number): void {
    crowd.write(this.#standing.array, this.#motion.array, this.count, index);
    this.count++;
  }

  upload(): void {
    this.mesh.visible = this.count > 0;
    this.mesh.geometry.instanceCount = this.count;
    for (const attribute of [this.#standing, this.#motion]) {
      attribute.clearUpdateRanges();
      attribute.addUpdateRange(0, attribute.itemSize * this.count);
      attribute.needsUpdate = true;
    }
  }
}
