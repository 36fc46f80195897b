// Instances of one skin, moved by the matrices that the kernel has written.

struct View {
  // Of projection and camera, for depths from -1 to 1.
  whole: mat4x4f,
  // Height of the ground, m, below which nothing shows.
  ground: f32,
  tints: array<vec4f, MOST_LEVELS>,
}

override INFLUENCES: u32 = 4;
@group(0) @binding(0) var<uniform> view: View;
@group(0) @binding(1) var<storage, read> matrices: array<vec4f>;
@group(0) @binding(2) var<storage, read> bodies: array<array<f32, BODY>>;

struct Shown {
  @builtin(position) at: vec4f,
  @location(0) tint: vec3f,
  @location(1) height: f32,
}

@vertex
fn skin(
  @builtin(instance_index) id: u32,
  @location(0) position: vec3f,
  @location(1) normal: vec3f,
  @location(2) joints: vec4u,
  @location(3) weights: vec4f,
) -> Shown {
  let rest = vec4f(position, 1.0);
  var place = vec3f(0.0);
  var facing = vec3f(0.0);
  var whole = 0.0;
  for (var i = 0u; i < INFLUENCES; i++) {
    if (weights[i] == 0.0) { break; }
    let at = 3u * (id * JOINTS + joints[i]);
    let x = matrices[at];
    let y = matrices[at + 1u];
    let z = matrices[at + 2u];
    place += weights[i] * vec3f(dot(x, rest), dot(y, rest), dot(z, rest));
    facing += weights[i] * vec3f(dot(x.xyz, normal), dot(y.xyz, normal), dot(z.xyz, normal));
    whole += weights[i];
  }
  place /= whole;
  let share = 0.5 + 0.5 * dot(normalize(facing), vec3f(0.42, 0.78, 0.46));
  let tint = view.tints[u32(bodies[id][LEVEL_AT])].rgb;
  var at = view.whole * vec4f(place, 1.0);
  at.z = 0.5 * (at.z + at.w);
  return Shown(at, min(vec3f(1.0), tint * (0.32 + 0.9 * share)), place.y);
}

@fragment
fn colour(shown: Shown) -> @location(0) vec4f {
  if (shown.height < view.ground) { discard; }
  let low = shown.tint * 12.92;
  let high = 1.055 * pow(shown.tint, vec3f(1.0 / 2.4)) - 0.055;
  return vec4f(select(high, low, shown.tint <= vec3f(0.0031308)), 1.0);
}
