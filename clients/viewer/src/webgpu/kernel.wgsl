// One workgroup computes one character: from controls to the matrices that move its skin. Constants
// before this text (layout.ts) say where the arrays of the kernel table begin and how long they are.

struct Body {
  // Cosine and sine of half the heading, and x and z, m.
  heading: vec2f,
  place: vec2f,
  // Seconds, or a share of the clip where `shares` is 1.
  time: f32,
  level: f32,
  motion: f32,
  shares: f32,
}

override DUMPED: bool = false;
@group(0) @binding(0) var<storage, read> t: array<f32>;
// Controls, then weights of labels, of each motion.
@group(0) @binding(1) var<storage, read> motions: array<f32>;
@group(0) @binding(2) var<storage, read> bodies: array<Body>;
// Three rows of each joint of each body.
@group(0) @binding(3) var<storage, read_write> matrices: array<vec4f>;
@group(0) @binding(4) var<storage, read_write> stages: array<f32>;

var<workgroup> w: array<f32, SCRATCH>;

@compute @workgroup_size(LANES)
fn pose(@builtin(workgroup_id) group: vec3u, @builtin(local_invocation_index) lane: u32) {
  let body = bodies[group.x];
  let own = LEVELS[u32(body.level)];
  let controls = u32(body.motion) * (CONTROLS + LABELS);
  basis(lane, controls);
  workgroupBarrier();
  covariances(lane, own);
  workgroupBarrier();
  values(lane, own);
  workgroupBarrier();
  core(lane, own);
  if (lane == 0u) { timing(body, controls); }
  workgroupBarrier();
  time(lane, own);
  workgroupBarrier();
  moves(lane, own);
  workgroupBarrier();
  numbers(lane, own);
  bones(lane);
  workgroupBarrier();
  rotations(lane);
  workgroupBarrier();
  joints(lane, body, group.x);
  if (DUMPED) {
    workgroupBarrier();
    for (var i = lane; i < SCRATCH; i += LANES) { stages[group.x * SCRATCH + i] = w[i]; }
  }
}

// Labels, one, and controls in half-ranges of their samples.
fn basis(lane: u32, controls: u32) {
  for (var i = lane; i < LINEAR; i += LANES) {
    let c = i - min(i, LABELS + 1u);
    let scaled = t[CONTROL_GAIN + c] * motions[controls + c] + t[CONTROL_SHIFT + c];
    let label = motions[controls + CONTROLS + min(i, LABELS)];
    w[BASIS + i] = select(select(scaled, 1.0, i == LABELS), label, i < LABELS);
  }
}

fn covariances(lane: u32, own: Level) {
  for (var n = lane; n < own.samples; n += LANES) {
    var squared = 0.0;
    for (var c = 0u; c < CONTROLS; c++) {
      let apart = t[CONTROL_SCALES + c] * w[BASIS + LABELS + 1u + c] - t[SAMPLES + c * COUNT + n];
      squared += apart * apart;
    }
    var found = covariance(squared);
    for (var s = 0u; s < SETS; s++) {
      let kept = t[LABEL_CORRELATIONS + s];
      found *= kept + (1.0 - kept) * w[BASIS + u32(t[LABEL_SAMPLES + s * COUNT + n])];
    }
    w[BASIS + LINEAR + n] = found;
  }
}

fn values(lane: u32, own: Level) {
  for (var m = lane; m < own.width; m += LANES) {
    var sum = 0.0;
    for (var i = 0u; i < LINEAR + own.samples; i++) { sum += w[BASIS + i] * t[own.weights + i * own.width + m]; }
    w[VALUES + m] = sum;
  }
}

fn core(lane: u32, own: Level) {
  let size = own.times * own.freedoms;
  for (var m = lane; m < size; m += LANES) {
    var sum = 0.0;
    for (var k = 0u; k < own.width - BESIDE; k++) { sum += w[VALUES + BESIDE + k] * t[own.core + k * size + m]; }
    w[MOTION + m] = sum;
  }
}

// Duration, s, and canonical frame.
fn timing(body: Body, controls: u32) {
  var log_duration = w[VALUES + TRAVEL + OFFSETS];
  for (var c = 0u; c < CONTROLS; c++) {
    log_duration += t[DURATION_EXPONENTS + c] * log(max(motions[controls + c], t[DURATION_FLOOR + c]));
  }
  let duration = exp(log_duration);
  let u = clamp(select(body.time / duration, body.time, body.shares == 1.0), 0.0, 1.0);
  let logs = VALUES + TRAVEL + OFFSETS + 1u;
  var most = -1e30;
  for (var k = 0u; k < WARP; k++) { most = max(most, w[logs + k] + t[WARP_STILL + k]); }
  var total = 0.0;
  var frame = 0.0;
  for (var k = 0u; k < WARP; k++) {
    let increment = exp(w[logs + k] + t[WARP_STILL + k] - most);
    var form = 0.0;
    for (var b = 0u; b < BREAKS; b++) {
      let hinge = max(u - t[WARP_BREAKS + b], 0.0);
      form += t[WARP_FORM + b * WARP + k] * select(hinge * hinge * hinge, select(u * u, u, b == 0u), b < 2u);
    }
    total += increment;
    frame += increment * form;
  }
  w[DURATION] = duration;
  w[FRAME] = clamp(frame / total, 0.0, f32(FRAMES - 1u));
}

fn time(lane: u32, own: Level) {
  let before = u32(w[FRAME]);
  let share = w[FRAME] - f32(before);
  let after = min(before + 1u, FRAMES - 1u);
  for (var j = lane; j < own.times; j += LANES) {
    let value = t[own.time + before * own.times + j];
    w[TIME + j] = value + share * (t[own.time + after * own.times + j] - value);
  }
}

fn moves(lane: u32, own: Level) {
  for (var i = lane; i < own.freedoms; i += LANES) {
    var sum = 0.0;
    for (var j = 0u; j < own.times; j++) { sum += w[TIME + j] * w[MOTION + j * own.freedoms + i]; }
    w[MOVES + i] = sum;
  }
}

fn numbers(lane: u32, own: Level) {
  for (var m = lane; m < NUMBER_COUNT; m += LANES) {
    var sum = t[own.pose + m];
    for (var i = 0u; i < own.freedoms; i++) { sum += w[MOVES + i] * t[own.pose + (i + 1u) * NUMBER_COUNT + m]; }
    w[NUMBERS + m] = sum;
  }
}

fn bones(lane: u32) {
  for (var m = lane; m < 3u * JOINTS; m += LANES) {
    var sum = t[OFFSET_MEAN + m];
    for (var o = 0u; o < OFFSETS; o++) { sum += w[VALUES + TRAVEL + o] * t[OFFSET_DIRECTIONS + o * 3u * JOINTS + m]; }
    w[BONES + m] = sum;
  }
}

// Cosine of an angle and sine over the angle, from its square: series at a half of it, which reach
// float32 up to angles of 2 pi, since the built-in functions may err by 5e-4.
fn turn(square: f32) -> vec2f {
  let x = 0.25 * square;
  var c = 1.0;
  var s = 1.0;
  for (var k = 8.0; k > 0.0; k -= 1.0) {
    c = 1.0 - c * x / ((2.0 * k - 1.0) * 2.0 * k);
    s = 1.0 - s * x / (2.0 * k * (2.0 * k + 1.0));
  }
  return vec2f(2.0 * c * c - 1.0, s * c);
}

// Rotation of a joint from its mean rotation and its pose numbers, by the factors of the chart.
fn rotation(mean: vec4f, numbers: vec4f) -> vec4f {
  let found = factors(dot(numbers, numbers));
  return mean * found.x + numbers * found.y;
}

fn rotations(lane: u32) {
  for (var j = lane; j < JOINTS; j += LANES) {
    let at = MEAN_ROTATIONS + 4u * j;
    let mean = vec4f(t[at], t[at + 1u], t[at + 2u], t[at + 3u]);
    keep(QUATERNIONS + 4u * j, rotation(mean, kept(NUMBERS + 3u + 4u * j)));
  }
  // The root has no bone: its place takes the place of one.
  if (lane == 0u) { travel(); }
}

// Root with the travel of a cycle, which grows evenly over the frames.
fn travel() {
  var place = vec3f(w[NUMBERS], w[NUMBERS + 1u], w[NUMBERS + 2u]);
  if (TRAVEL > 0u) {
    let share = w[FRAME] / f32(FRAMES - 1u);
    place += share * vec3f(w[VALUES], 0.0, w[VALUES + 1u]);
    let angle = 0.5 * share * w[VALUES + 2u];
    let found = turn(angle * angle);
    keep(QUATERNIONS, product(vec4f(found.x, 0.0, angle * found.y, 0.0), kept(QUATERNIONS)));
  }
  w[BONES] = place.x;
  w[BONES + 1u] = place.y;
  w[BONES + 2u] = place.z;
}

// Each joint follows its ancestors to the world, without waiting for them.
fn joints(lane: u32, body: Body, id: u32) {
  for (var j = lane; j < JOINTS; j += LANES) {
    var q = kept(QUATERNIONS + 4u * j);
    var p = bone(j);
    for (var a = i32(t[PARENTS + j]); a >= 0; a = i32(t[PARENTS + u32(a)])) {
      let own = kept(QUATERNIONS + 4u * u32(a));
      p = turned(own, p) + bone(u32(a));
      q = product(own, q);
    }
    w[PLACES + 3u * j] = p.x;
    w[PLACES + 3u * j + 1u] = p.y;
    w[PLACES + 3u * j + 2u] = p.z;
    let heading = vec4f(body.heading.x, 0.0, body.heading.y, 0.0);
    let place = turned(heading, p) + vec3f(body.place.x, 0.0, body.place.y);
    let whole = product(heading, q);
    let rest = vec3f(t[REST + 3u * j], t[REST + 3u * j + 1u], t[REST + 3u * j + 2u]);
    let shift = place - turned(whole, rest);
    let x = turned(whole, vec3f(1.0, 0.0, 0.0));
    let y = turned(whole, vec3f(0.0, 1.0, 0.0));
    let z = turned(whole, vec3f(0.0, 0.0, 1.0));
    let at = 3u * (id * JOINTS + j);
    matrices[at] = vec4f(x.x, y.x, z.x, shift.x);
    matrices[at + 1u] = vec4f(x.y, y.y, z.y, shift.y);
    matrices[at + 2u] = vec4f(x.z, y.z, z.z, shift.z);
  }
}

fn bone(j: u32) -> vec3f {
  return vec3f(w[BONES + 3u * j], w[BONES + 3u * j + 1u], w[BONES + 3u * j + 2u]);
}

// Quaternions are w x y z.
fn kept(at: u32) -> vec4f { return vec4f(w[at], w[at + 1u], w[at + 2u], w[at + 3u]); }

fn keep(at: u32, q: vec4f) {
  w[at] = q.x;
  w[at + 1u] = q.y;
  w[at + 2u] = q.z;
  w[at + 3u] = q.w;
}

fn product(a: vec4f, b: vec4f) -> vec4f {
  return vec4f(a.x * b.x - dot(a.yzw, b.yzw), a.x * b.yzw + b.x * a.yzw + cross(a.yzw, b.yzw));
}

fn turned(q: vec4f, v: vec3f) -> vec3f {
  let across = 2.0 * cross(q.yzw, v);
  return v + q.x * across + cross(q.yzw, across);
}
