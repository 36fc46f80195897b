/** Small motion files, made for a test. */

/** A figure of a hip, two legs of 80 and a head, in centimetres; `up` says its axis. */
export function bvh({ frames = 3, seconds = 0.01, scale = 1, up = "y" as "y" | "z" } = {}): string {
  const offset = (side: number, high: number) => {
    const [x, y] = [side * scale, high * scale];
    return `OFFSET ${up === "y" ? `${x} ${y} 0` : `${x} 0 ${y}`}`;
  };
  const turns = "CHANNELS 3 Zrotation Xrotation Yrotation";
  const leg = (side: string, sign: number) => `JOINT ${side}UpLeg { ${offset(10 * sign, 0)} ${turns}
    JOINT ${side}Leg { ${offset(0, -40)} ${turns}
      JOINT ${side}Foot { ${offset(0, -40)} ${turns} End Site { OFFSET 0 -5 0 } } } }`;
  const rows = Array.from({ length: frames }, (_, frame) => {
    const place = up === "y" ? [0, 90 * scale, frame * scale] : [0, frame * scale, 90 * scale];
    return [
      ...place,
      ...Array.from({ length: 24 }, (_, at) => (at % 3 === 1 ? frame % 2 : 0)),
    ].join(" ");
  });
  return `HIERARCHY
ROOT Hips { ${offset(0, 90)} CHANNELS 6 Xposition Yposition Zposition Zrotation Xrotation Yrotation
  ${leg("Left", 1)}
  ${leg("Right", -1)}
  JOINT Head { ${offset(0, 60)} ${turns} End Site { OFFSET 0 10 0 } }
}
MOTION
Frames: ${frames}
Frame Time: ${seconds}
${rows.join("\n")}
`;
}

interface Wanted {
  /** Times of the keys of each animation, s. */
  readonly keys?: readonly (readonly number[])[];
  readonly skinned?: boolean;
  readonly change?: (parts: Record<string, unknown>) => void;
}

const JOINTS = ["Hips", "LeftUpLeg", "LeftLeg", "LeftFoot"];
const PLACES = [
  [0, 0.9, 0],
  [0.1, 0, 0],
  [0, -0.4, 0],
  [0, -0.4, 0],
];

/** A GLB of a hip and a leg, which the hip carries along z by a metre in each animation. */
export function glb({
  keys = [[0, 0.1, 0.2]],
  skinned = true,
  change,
}: Wanted = {}): Uint8Array<ArrayBuffer> {
  const numbers: number[] = [];
  const accessors: unknown[] = [];
  const bufferViews: unknown[] = [];
  const add = (values: readonly number[], type: string, width: number) => {
    bufferViews.push({ buffer: 0, byteOffset: 4 * numbers.length, byteLength: 4 * values.length });
    numbers.push(...values);
    accessors.push({
      bufferView: bufferViews.length - 1,
      componentType: 5126,
      count: values.length / width,
      type,
    });
    return accessors.length - 1;
  };
  const animations = keys.map((times, index) => {
    const input = add(times, "SCALAR", 1);
    const output = add(
      times.flatMap((_, at) => [0, 0.9, at / Math.max(times.length - 1, 1)]),
      "VEC3",
      3,
    );
    return {
      name: `take${index}`,
      samplers: [{ input, output }],
      channels: [{ sampler: 0, target: { node: 0, path: "translation" } }],
    };
  });
  const parts: Record<string, unknown> = {
    asset: { version: "2.0" },
    nodes: JOINTS.map((name, node) => ({
      name,
      translation: PLACES[node],
      ...(node < 3 && { children: [node + 1] }),
    })),
    ...(skinned && { skins: [{ joints: [0, 1, 2, 3] }] }),
    ...(animations.length && { animations }),
    accessors,
    bufferViews,
    buffers: [{ byteLength: 4 * numbers.length }],
  };
  change?.(parts);
  return packed(parts, Float32Array.from(numbers));
}

/** A container of JSON and numbers. */
function packed(parts: unknown, numbers: Float32Array): Uint8Array<ArrayBuffer> {
  const text = new TextEncoder().encode(JSON.stringify(parts));
  const padded = Math.ceil(text.length / 4) * 4;
  const binary = new Uint8Array(numbers.buffer);
  const found = new Uint8Array(12 + 8 + padded + 8 + binary.length).fill(32);
  const view = new DataView(found.buffer);
  const words = [0x46546c67, 2, found.length, padded, 0x4e4f534a];
  for (const [at, word] of words.entries()) view.setUint32(4 * at, word, true);
  found.set(text, 20);
  view.setUint32(20 + padded, binary.length, true);
  view.setUint32(24 + padded, 0x004e4942, true);
  found.set(binary, 28 + padded);
  return found;
}

/** A layer with a skeleton and an animation of it; without one of them where that is `false`. */
export function usda({ skeleton = true, animation = true, stated = true, more = "" } = {}): string {
  const joints =
    '["Hips", "Hips/LeftUpLeg", "Hips/LeftUpLeg/LeftLeg", "Hips/LeftUpLeg/LeftLeg/LeftFoot"]';
  const at = (x: number, y: number) =>
    `( (1, 0, 0, 0), (0, 1, 0, 0), (0, 0, 1, 0), (${x}, ${y}, 0, 1) )`;
  const rest = `[${at(0, 90)}, ${at(10, 0)}, ${at(0, -40)}, ${at(0, -40)}]`;
  const bind = `[${at(0, 90)}, ${at(10, 90)}, ${at(10, 50)}, ${at(10, 10)}]`;
  const frames = [0, 1, 2].map(
    (code) => `${code}: [(0, 90, ${50 * code}), (10, 0, 0), (0, -40, 0), (0, -40, 0)],`,
  );
  const own = animation
    ? `def SkelAnimation "Anim" {
        uniform token[] joints = ${joints}
        quatf[] rotations = [(1, 0, 0, 0), (1, 0, 0, 0), (1, 0, 0, 0), (1, 0, 0, 0)]
        half3[] scales = [(1, 1, 1), (1, 1, 1), (1, 1, 1), (1, 1, 1)]
        float3[] translations.timeSamples = {
            ${frames.join("\n            ")}
        }
    }`
    : "";
  const skel = skeleton
    ? `def Skeleton "Skel" {
        uniform token[] joints = ${joints}
        uniform matrix4d[] bindTransforms = ${bind}
        uniform matrix4d[] restTransforms = ${rest}
        rel skel:animationSource = </Figure/Anim>
    }`
    : "";
  const said = stated
    ? `(
    metersPerUnit = 0.01
    timeCodesPerSecond = 30
    upAxis = "Y"
)
`
    : "";
  return `#usda 1.0
${said}
def SkelRoot "Figure" {
    ${skel}
    ${own}
    ${more}
}
`;
}
