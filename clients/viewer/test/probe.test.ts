/** What is said of motion files: their facts, what they lack, and why they are refused. */

import assert from "node:assert/strict";
import { describe, it } from "node:test";

import { REFUSED } from "../src/probe/formats.ts";
import { rateOfKeys, snappedRate } from "../src/probe/frame-rate.ts";
import { limbs } from "../src/probe/limbs.ts";
import { general } from "../src/probe/numbers.ts";
import { type Report, report } from "../src/probe/report.ts";
import { bvh, glb, usda } from "./probe-files.ts";

async function said(name: string, content: BlobPart, ...others: File[]): Promise<Report> {
  const file = new File([content], name);
  return report(file, [file, ...others]);
}

function fact(found: Report, key: string): string {
  const { value = "", confidence = null } = found.facts.find((each) => each.key === key) ?? {};
  return confidence ? `${value}, ${confidence}` : value;
}

async function refusal(name: string, content: BlobPart): Promise<string> {
  const found = await said(name, content);
  assert.ok(found.refused, `${name} is read: ${found.said}`);
  return found.said;
}

describe("BVH", () => {
  it("is told by its legs, its body and its frame time", async () => {
    const found = await said("kick.bvh", bvh({ frames: 300 }));
    assert.equal(found.said, "BVH file, 300 frames, 2.99 s");
    assert.equal(fact(found, "metres_per_unit"), "0.01 m, high");
    // It walks straight: no joint leaves its x.
    assert.equal(fact(found, "up"), "y, medium");
    assert.equal(fact(found, "fps"), "100.0 frames a second, certain");
    assert.equal(
      fact(found, "travel"),
      "2.99 m from the first frame to the last, across the floor",
    );
    assert.match(fact(found, "joints"), /^Hips, LeftUpLeg, LeftLeg, LeftFoot, RightUpLeg/);
  });

  it("in other units, axes and rates is told so", async () => {
    const found = await said("kick.bvh", bvh({ scale: 10, up: "z", seconds: 0.0333667 }));
    assert.equal(fact(found, "metres_per_unit"), "0.001 m, high");
    assert.match(fact(found, "up"), /^z/);
    assert.equal(fact(found, "fps"), `${(30 * 1000) / 1001} frames a second, certain`);
  });

  for (const [name, content, expected] of [
    [
      "cut in the numbers",
      bvh().slice(0, -30),
      /expected 3 frames x 27 channels = 81: the file is not whole/,
    ],
    ["cut in the skeleton", bvh().slice(0, 300), /expected/],
    ["without motion", bvh().split("MOTION")[0]!, /found no line MOTION/],
    [
      "with a word among the numbers",
      bvh().replace("\n0 90 0", "\n0 ninety 0"),
      /found 'ninety' in frame 1, expected a number/,
    ],
    [
      "with a joint twice",
      bvh().replace("RightFoot", "LeftFoot"),
      /line \d+: joint name 'LeftFoot' stands twice/,
    ],
    [
      "with an unknown channel",
      bvh().replace("Yposition", "Wposition"),
      /line 2: found 'Wposition', expected a channel/,
    ],
    [
      "without a frame time",
      bvh().replace("Frame Time", "Time"),
      /expected 'Frames: N' of at least 1 and 'Frame Time: seconds'/,
    ],
    ["of another kind", "PK\u0003\u0004", /expected HIERARCHY/],
    ["that is empty", "", /found 0 bytes/],
  ] as const)
    it(`${name} is refused`, async () => {
      assert.match(await refusal("kick.bvh", content), expected);
    });

  it("whose root stays while another joint moves is warned of", async () => {
    const still = bvh().replace(/^0 90 \d+ /gm, "0 90 0 ");
    assert.deepEqual((await said("kick.bvh", still)).warnings, []);
    const head = still.replace(
      /(JOINT Head.*?)CHANNELS 3/,
      "$1CHANNELS 6 Xposition Yposition Zposition",
    );
    const moved = head.replace(/^0 90 0 .*(?= \S+ \S+ \S+$)/gm, (row, at) => `${row} 0 60 ${at}`);
    assert.deepEqual((await said("kick.bvh", moved)).warnings, [
      "the root 'Hips' stays in place while 'Head' moves: make 'Head' the root, or its motion is lost",
    ]);
  });
});

describe("glTF", () => {
  it("states its unit and axis, and its keys are frames", async () => {
    const found = await said("kick.glb", glb());
    assert.equal(found.said, "glTF file, 3 frames, 0.20 s");
    assert.equal(fact(found, "metres_per_unit"), "1.0 m, certain");
    assert.equal(fact(found, "up"), "y, certain");
    assert.equal(fact(found, "fps"), "10.0 frames a second, certain");
    assert.equal(
      fact(found, "travel"),
      "1.00 m from the first frame to the last, across the floor",
    );
    assert.deepEqual(found.warnings, []);
  });

  it("in centimetres contradicts its format", async () => {
    const nodes = (parts: Record<string, unknown>) => {
      for (const node of parts["nodes"] as { translation: number[] }[])
        node.translation = node.translation.map((each) => 100 * each);
    };
    const found = await said("kick.glb", glb({ change: nodes }));
    assert.equal(fact(found, "metres_per_unit"), "1.0 m, low");
    const { evidence } = found.facts.find(({ key }) => key === "metres_per_unit")!;
    assert.equal(
      evidence[0],
      "stated by the files: 1.0 m, which the motion contradicts: 0.01 m fits it",
    );
  });

  it("with several animations lists them", async () => {
    const found = await said(
      "kick.glb",
      glb({
        keys: [
          [0, 0.1, 0.2],
          [0, 0.05],
        ],
      }),
    );
    assert.equal(fact(found, "animations"), "2");
    assert.match(found.warnings[0]!, /^found 2 animations \('take0', 'take1'\), expected one/);
  });

  it("without animation or with uneven keys is warned of", async () => {
    const still = await said("kick.glb", glb({ keys: [] }));
    assert.equal(still.said, "glTF file, no motion");
    assert.match(still.warnings[0]!, /^found no animation, a skeleton or mesh without motion/);
    const uneven = await said("kick.glb", glb({ keys: [[0, 0.1, 0.5]] }));
    assert.match(uneven.warnings[0]!, /keys at uneven times, 0.1 to 0.4 s apart/);
    assert.equal(uneven.said, "glTF file, 3 frames, unknown s");
  });

  it("without a skin is the tree of animated nodes", async () => {
    const found = await said("kick.glb", glb({ skinned: false }));
    assert.deepEqual(found.notes, [
      "no skin: the tree of animated nodes was taken as the skeleton",
    ]);
  });

  it("with its buffer beside it needs both files", async () => {
    const content = glb();
    const length = new DataView(content.buffer).getUint32(12, true);
    const parts = JSON.parse(new TextDecoder().decode(content.slice(20, 20 + length)));
    parts.buffers[0].uri = "kick.bin";
    const text = JSON.stringify(parts);
    assert.match(await refusal("kick.gltf", text), /refers to kick.bin beside it: drop both files/);
    const found = await said("kick.gltf", text, new File([content.slice(28 + length)], "kick.bin"));
    assert.equal(found.said, "glTF file, 3 frames, 0.20 s");
  });

  for (const [name, content, expected] of [
    ["cut", glb().slice(0, -8), /of \d+ bytes, expected a whole file of version 2/],
    ["of another kind", "solid stl", /^not glTF/],
    ["of version 1", '{"asset":{"version":"1.0"}}', /found version 1.0 of glTF, expected 2.0/],
    [
      "without a skeleton",
      glb({ keys: [], skinned: false }),
      /found no skin and no tree of animated nodes/,
    ],
    [
      "compressed",
      glb({
        change: (parts) => {
          parts["extensionsRequired"] = ["EXT_meshopt_compression"];
        },
      }),
      /requires the extensions EXT_meshopt_compression/,
    ],
    [
      "in a circle",
      glb({
        change: (parts) => {
          (parts["nodes"] as { children?: number[] }[])[3]!.children = [0];
        },
      }),
      /node \d is its own ancestor/,
    ],
    [
      "with a wrong accessor",
      glb({
        change: (parts) => {
          (parts["accessors"] as { count: number }[])[0]!.count = 99;
        },
      }),
      /expected/,
    ],
  ] as const)
    it(`${name} is refused`, async () => {
      assert.match(await refusal("kick.glb", content), expected);
    });
});

describe("USD", () => {
  it("states its unit, its axis and its rate", async () => {
    const found = await said("kick.usda", usda());
    assert.equal(found.said, "USD file, 3 frames, 0.07 s");
    assert.equal(fact(found, "metres_per_unit"), "0.01 m, certain");
    assert.equal(fact(found, "up"), "y, certain");
    assert.equal(fact(found, "fps"), "30.0 frames a second, certain");
    assert.equal(
      fact(found, "travel"),
      "1.00 m from the first frame to the last, across the floor",
    );
    assert.deepEqual([found.warnings, found.notes], [[], []]);
  });

  it("that states nothing is measured, and the format's default is named", async () => {
    const found = await said("kick.usda", usda({ stated: false }));
    assert.equal(fact(found, "metres_per_unit"), "0.01 m, high");
    assert.equal(fact(found, "fps"), "24.0 frames a second, certain");
    assert.deepEqual(found.notes, ["states no timeCodesPerSecond, 24 is USD's default"]);
  });

  it("without a skeleton or an animation is warned of", async () => {
    const still = await said("kick.usda", usda({ animation: false }));
    assert.deepEqual(still.warnings, [
      "found the skeleton /Figure/Skel without a SkelAnimation, expected one",
    ]);
    assert.match(fact(still, "joints"), /^Hips, LeftUpLeg/);
    const bare = await said("kick.usda", usda({ skeleton: false }));
    assert.deepEqual(bare.warnings, [
      "found 1 animations and no Skeleton, expected a SkelRoot with one",
    ]);
    assert.match(
      await refusal("kick.usda", usda({ skeleton: false, animation: false })),
      /found no Skeleton/,
    );
  });

  it("with other files, transforms or more animations says what is not looked at", async () => {
    const more = 'def SkelAnimation "Other" {\n    uniform token[] joints = ["Hips"]\n    }';
    const found = await said("kick.usda", usda({ more }));
    assert.equal(fact(found, "animations"), "2");
    assert.match(found.warnings[0]!, /^found 2 animations \(\/Figure\/Anim, \/Figure\/Other\)/);
    const moved = usda().replace(
      'def Skeleton "Skel" {',
      'def Skeleton "Skel" {\n        uniform token[] xformOpOrder = ["xformOp:scale"]',
    );
    assert.match(
      (await said("kick.usda", moved)).notes[0]!,
      /^transforms above the skeleton \(\/Figure\/Skel\)/,
    );
  });

  for (const [name, content, expected] of [
    [
      "cut",
      usda().slice(0, -100),
      /ends with \d brackets open, expected none: the file is not whole/,
    ],
    ["of another kind", "hello world", /begins with 'hello wo', expected '#usda' or 'PXR-USDC'/],
    ["binary and cut", `PXR-USDC${"\u0000".repeat(40)}`, /does not open as USD/],
    ["a broken package", "PK\u0003\u0004", /found no file in the package/],
  ] as const)
    it(`${name} is refused`, async () => {
      assert.match(await refusal("kick.usd", content), expected);
    });
});

describe("other files", () => {
  it("are refused with the way out", async () => {
    for (const [suffix, way] of Object.entries(REFUSED))
      assert.equal(await refusal(`kick${suffix}`, "x"), way);
    assert.match(await refusal("kick.amc", "x"), /posefield convert FILE.amc/);
    assert.match(
      await refusal("kick.txt", "x"),
      /found the suffix '.txt', expected one of .bvh, .glb/,
    );
  });

  it("above the limit are refused unread", async () => {
    const file = new File(["x"], "kick.usdc");
    Object.defineProperty(file, "size", { value: 101_000_000 });
    assert.match(
      (await report(file, [file])).said,
      /found 101 MB, expected at most 100 MB on this page/,
    );
  });
});

describe("rates and joints", () => {
  it("rates are those that rounded times stand for", () => {
    assert.equal(snappedRate(0.008333), 120);
    assert.equal(snappedRate(0.0333667), 30000 / 1001);
    assert.equal(snappedRate(0.013), 1 / 0.013);
    assert.throws(
      () => rateOfKeys(Float64Array.of(0, 0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 1)),
      /1 dropped frames of 11/,
    );
    assert.throws(() => rateOfKeys(Float64Array.of(0, 1, 2)), /3 keys at 1 a second/);
    assert.throws(() => rateOfKeys(Float64Array.of(0)), /1 key, a pose without motion/);
  });

  it("numbers have as many digits as on the command line", () => {
    const shown = [0.00012345, 1234567, 0.5, 81.694, 1e-7].map((each) => general(each, 4));
    assert.deepEqual(shown, ["0.0001234", "1.235e+06", "0.5", "81.69", "1e-07"]);
  });

  it("legs are found under other names, and none where there are none", () => {
    const named = [
      "mixamorig:Hips",
      "mixamorig:RightUpLeg",
      "mixamorig:RightLeg",
      "mixamorig:RightFoot",
    ];
    assert.deepEqual(
      [...limbs(named, [-1, 0, 1, 2])],
      [
        ["rightUpperLeg", 1],
        ["rightLowerLeg", 2],
        ["rightFoot", 3],
      ],
    );
    assert.deepEqual([...limbs(["a", "constructor", "box"], [-1, 0, 1])], []);
  });
});
