/** The floor: lines a metre and a tenth of one apart, that fade into the distance. */

import { Color, Mesh, PlaneGeometry, ShaderMaterial, UniformsLib, UniformsUtils } from "three";

const VERTEX = `
#include <common>
#include <shadowmap_pars_vertex>
varying vec3 place;
varying vec2 local;
void main() {
  vec3 objectNormal = vec3(0.0, 0.0, 1.0);
  vec3 transformedNormal = normalMatrix * objectNormal;
  local = position.xy;
  vec4 worldPosition = modelMatrix * vec4(position, 1.0);
  place = worldPosition.xyz;
  gl_Position = projectionMatrix * viewMatrix * worldPosition;
  #include <shadowmap_vertex>
}`;

const FRAGMENT = `
#include <common>
#include <packing>
#include <lights_pars_begin>
#include <shadowmap_pars_fragment>
#include <shadowmask_pars_fragment>
uniform vec3 paper;
uniform vec3 ink;
uniform float dim;
varying vec3 place;
varying vec2 local;
float lines(float every) {
  vec2 at = place.xz / every;
  vec2 wide = fwidth(at);
  vec2 far = abs(fract(at - 0.5) - 0.5) / max(wide, 1e-6);
  return (1.0 - min(min(far.x, far.y), 1.0)) * (1.0 - smoothstep(0.2, 0.6, max(wide.x, wide.y)));
}
void main() {
  float fade = 1.0 - smoothstep(0.1, 1.0, length(local) / 12.0);
  float line = max(0.55 * lines(1.0), 0.2 * lines(0.25));
  vec3 colour = mix(paper, ink, line * fade * 0.5);
  // Shadows fall near the middle, and cost where they are looked for.
  if (length(local) < 2.6) colour = mix(colour, colour * dim, 1.0 - getShadowMask());
  gl_FragColor = vec4(colour, 1.0);
  #include <colorspace_fragment>
}`;

export class Ground {
  readonly mesh: Mesh<PlaneGeometry, ShaderMaterial>;

  constructor() {
    const uniforms = UniformsUtils.merge([
      UniformsLib.lights,
      { paper: { value: new Color() }, ink: { value: new Color() }, dim: { value: 0.8 } },
    ]);
    const material = new ShaderMaterial({
      vertexShader: VERTEX,
      fragmentShader: FRAGMENT,
      uniforms,
      lights: true,
    });
    this.mesh = new Mesh(new PlaneGeometry(60, 60), material);
    this.mesh.rotation.x = -Math.PI / 2;
    this.mesh.receiveShadow = true;
  }

  tint(paper: string, ink: string, dim: number): void {
    const { uniforms } = this.mesh.material;
    (uniforms["paper"]!.value as Color).set(paper);
    (uniforms["ink"]!.value as Color).set(ink);
    uniforms["dim"]!.value = dim;
  }
}
