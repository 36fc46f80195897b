/** The kernel table of a model (service/posefield/encode/kernel_file.py), and its layout as WGSL. */

/** Names and shapes of the arrays, which lie one after the other in `numbers`. */
export interface Table {
  readonly numbers: Float32Array<ArrayBuffer>;
  /** First number and shape of each array. */
  readonly arrays: Readonly<
    Record<string, { readonly at: number; readonly shape: readonly number[] }>
  >;
  readonly facts: Readonly<Record<string, string>>;
}

/** Invocations of a workgroup, each of which computes a part of a character. */
export const LANES = 64;
/** Numbers of a body, and which of them is its level. */
export const [BODY, LEVEL_AT] = [8, 5];
export const MOST_LEVELS = 8;

/** Correlations by squares of scaled distances, as the graph has them. */
export const COVARIANCES: Readonly<Record<string, string>> = {
  exponential: "exp(-a)",
  gaussian: "exp(-s)",
  spherical: "1.0 - 1.5 * min(a, 1.0) + 0.5 * pow(min(a, 1.0), 3.0)",
  matern32: "(1.0 + a) * exp(-a)",
  matern52: "(1.0 + a + s / 3.0) * exp(-a)",
};

/** Charts of rotations: factors of the mean rotation and the pose numbers, by their square `s`. */
const CHARTS: Readonly<Record<string, string>> = {
  rotation_vector: "turn(s)",
  stereographic: "vec2f(1.0 - s, 2.0) / (1.0 + s)",
};

/** Of a level: its sizes, and the arrays whose first numbers it knows. */
const SIZES = ["samples", "width", "freedoms", "times"];
const STARTS = ["weights", "time", "core", "pose"];

interface Header {
  readonly __metadata__: Readonly<Record<string, string>>;
  readonly [name: string]: unknown;
}

/** Reads a safetensors file of float32 arrays. */
export function read(content: Uint8Array): Table {
  const view = new DataView(content.buffer, content.byteOffset);
  const size = Number(view.getBigUint64(0, true));
  const text = new TextDecoder().decode(content.subarray(8, 8 + size));
  const { __metadata__: facts, ...rest } = JSON.parse(text) as Header;
  const own = rest as Record<string, { shape: number[]; data_offsets: [number, number] }>;
  const arrays = Object.fromEntries(
    Object.entries(own).map(([name, { shape, data_offsets }]) => [
      name,
      { at: data_offsets[0] / 4, shape },
    ]),
  );
  return { numbers: new Float32Array(content.slice(8 + size).buffer), arrays, facts };
}

/** Parts of a workgroup's memory, one after the other: name and numbers. */
export interface Layout {
  readonly text: string;
  /** First number and count of each stage in a workgroup's memory. */
  readonly stages: Readonly<Record<string, readonly [at: number, count: number]>>;
  /** Numbers of a workgroup's memory. */
  readonly scratch: number;
  readonly joints: number;
  /** Numbers of a motion: its controls, and a weight for each label. */
  readonly motion: number;
}

/** Constants and types that the kernel's text needs before it. */
export function layout(table: Table): Layout {
  const sizes = measured(table);
  const { joints, weights, count, labels, controls } = sizes;
  const [stages, scratch] = laid({
    basis: weights,
    values: sizes.width,
    motion: sizes.times * sizes.freedoms,
    duration: 1,
    frame: 1,
    time: sizes.times,
    moves: sizes.freedoms,
    numbers: 3 + 4 * joints,
    bones: 3 * joints,
    quaternions: 4 * joints,
    places: 3 * joints,
  });
  const constants = {
    // Models without labels have none of these, and read none.
    ...{ label_correlations: 0, label_samples: 0 },
    ...Object.fromEntries(Object.entries(table.arrays).map(([name, { at }]) => [name, at])),
    ...Object.fromEntries(Object.entries(stages).map(([name, [at]]) => [name, at])),
    ...sizes,
    ...{ lanes: LANES, scratch, linear: weights - count, number_count: 3 + 4 * joints },
  };
  const lines = Object.entries(constants).map(
    ([name, value]) => `const ${name.toUpperCase()} = ${value}u;`,
  );
  const text = `${lines.join("\n")}
struct Level { ${[...SIZES, ...STARTS].map((name) => `${name}: u32`).join()} }
const LEVELS = ${levels(table, weights - count)};
fn covariance(s: f32) -> f32 { let a = sqrt(s); return ${known(COVARIANCES, table, "covariance")}; }
fn factors(s: f32) -> vec2f { return ${known(CHARTS, table, "chart")}; }
`;
  return { text, stages, scratch, joints, motion: controls + labels };
}

/** The formula that a fact of a table names. */
function known(formulas: Readonly<Record<string, string>>, { facts }: Table, fact: string): string {
  const found = formulas[facts[fact]!];
  if (!found) throw new Error(`${fact} ${facts[fact]} is not known`);
  return found;
}

/** Sizes of a model, of its finest level where levels differ. */
function measured({ arrays, facts }: Table) {
  const shape = (name: string) => arrays[name]?.shape ?? [0, 0];
  const [controls, count] = shape("samples") as [number, number];
  const [weights, width] = shape("weights_0") as [number, number];
  const [frames, times] = shape("time_0") as [number, number];
  const travel = facts["cyclic"] === "true" ? 3 : 0;
  const [warp, offsets] = [shape("warp_still")[0]!, shape("offset_directions")[0]!];
  return {
    ...{ controls, count, weights, width, frames, times, travel, warp, offsets },
    joints: shape("parents")[0]!,
    labels: weights - count - 1 - controls,
    freedoms: shape("pose_0")[0]! - 1,
    sets: shape("label_correlations")[0]!,
    breaks: shape("warp_breaks")[0]!,
    // Columns of weights before the coefficients.
    beside: travel + offsets + 1 + warp,
  };
}

/** Parts of a memory one after the other, and its size. */
function laid(sizes: Readonly<Record<string, number>>): [Layout["stages"], number] {
  let at = 0;
  const found = Object.entries(sizes).map(([name, size]) => {
    at += size;
    return [name, [at - size, size]] as const;
  });
  return [Object.fromEntries(found), at];
}

/** The levels as an array of the shader; linear: rows of weights before those of samples. */
function levels({ arrays }: Table, linear: number): string {
  const rows: string[] = [];
  for (let level = 0; `weights_${level}` in arrays; level++) {
    const own = (name: string) => arrays[`${name}_${level}`]!;
    const [weights, width] = own("weights").shape as [number, number];
    const sizes = [weights - linear, width, own("pose").shape[0]! - 1, own("time").shape[1]!];
    const starts = STARTS.map((name) => own(name).at);
    rows.push(`Level(${[...sizes, ...starts].map((value) => `${value}u`).join()})`);
  }
  return `array<Level, ${rows.length}>(${rows.join()})`;
}
