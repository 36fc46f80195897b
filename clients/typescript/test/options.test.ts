/** Misspelt options: refused before anything is sent, with the known name that is most like them. */

import assert from "node:assert/strict";
import { test } from "node:test";

import { Client, type ClipQuestion, type Floor, WrongQuestion } from "../src/index.ts";
import { similarName } from "../src/option-names.ts";
import { link } from "../src/questions.ts";
import { KEYS } from "../src/schema.ts";

const controls = { speed: 1 };
/** As JavaScript asks, which nobody checks before it runs. */
const asked = (question: object): ClipQuestion => question as ClipQuestion;
const client = new Client("http://127.0.0.1:9", { retries: 0 });

const MISSPELT: Readonly<Record<string, [() => Promise<unknown> | string, string]>> = {
  controls: [
    () => client.clip("walk", asked({ contrls: controls })),
    "contrls (did you mean controls?)",
  ],
  frames: [() => client.clip("walk", asked({ controls, fp: 60 })), "fp (did you mean fps?)"],
  unlike: [() => client.clip("walk", asked({ controls, colour: 1 })), "colour, expected some of"],
  link: [() => client.url("walk", "glb", asked({ controls, Fps: 60 })), "Fps (did you mean fps?)"],
  file: [
    () => client.file("walk", "glb", asked({ controls, lop: true })),
    "lop (did you mean loop?)",
  ],
  pose: [
    () => client.pose("walk", { controls, times: [0], ...{ exakt: "none" } }),
    "exakt (did you mean exact?)",
  ],
  target: [
    () =>
      client.pose("walk", {
        controls,
        times: [0],
        targets: [{ joint: "a", position: [0, 1, 0], at: "end", ...{ postion: 1 } }],
      }),
    "Target: found postion (did you mean position?)",
  ],
  floor: [
    () =>
      client.clip("walk", {
        controls,
        floor: { height: 0, slope_x: 0, slope_z: 0.1, ...{ slop_y: 1 } },
      }),
    "Floor: found slop_y",
  ],
  crowd: [() => client.crowd("walk", { controls, time: 0, ...{ headng: 1 } }), "headng (did you"],
  walk: [
    () => client.crowdFile("walk", "usda", { ...{ seconds: 3, cuont: 3 } }),
    "cuont (did you mean count?)",
  ],
  archive: [
    () => client.archive("walk", "glb", [{ controls, ...{ nmae: "a" } }]),
    "NamedClipQuestion: found nmae",
  ],
  stream: [
    () =>
      client.stream("walk", "glb", [{ controls }], {
        ...{ as: "zip" as const, onprogress: () => {} },
      }),
    "ArchiveOptions: found onprogress (did you mean onProgress?)",
  ],
  sigma: [
    () => client.sigma("walk", { across: "a", along: "b", ...{ marign: 1 } }),
    "(did you mean",
  ],
  why: [() => client.why("walk", { controls, ...{ nearst: 3 } }), "nearst (did you mean nearest?)"],
  suggestions: [
    () => client.suggestions("walk", { ...{ performer: "a", cont: 3 } }),
    "cont (did you mean count?)",
  ],
};

for (const [name, [ask, said]] of Object.entries(MISSPELT)) {
  test(`a misspelt option is refused: ${name}`, async () => {
    await assert.rejects(
      async () => ask(),
      (fault) => fault instanceof WrongQuestion && fault.message.includes(said),
    );
  });
}

test("options of the client are checked", () => {
  const options = { ...{ retries: 1, timeuot: 3 } };
  assert.throws(
    () => new Client("", options),
    /ClientOptions: found timeuot \(did you mean timeout\?\)/,
  );
});

test("every key of the contract is accepted", () => {
  // Negative control of the checks: a link with each known key at once.
  const all = Object.fromEntries(KEYS.ClipQuestion.map((key) => [key, undefined]));
  assert.match(client.url("walk", "glb", asked({ ...all, controls })), /clip\.glb\?speed=1$/);
});

test("a name is suggested only if it is nearest and near", () => {
  assert.equal(similarName("RightHnd", ["LeftHand", "RightHand"]), "RightHand");
  assert.equal(similarName("usd", ["usda", "usdc"]), undefined);
  assert.equal(similarName("colour", ["fps", "loop"]), undefined);
  assert.equal(similarName("a".repeat(41), ["a".repeat(40)]), undefined);
});

test("each label set is a parameter, and weights are a list", () => {
  const labels = { style: { angry: 0.75, happy: 0.25 }, performer: "kim" };
  const { searchParams } = new URL(link("/v1", { labels, controls: { speed: 1 } }), "http://any");
  assert.deepEqual(
    [...searchParams],
    [
      ["speed", "1"],
      ["label", "style=angry:0.75,happy:0.25"],
      ["label", "performer=kim"],
    ],
  );
  assert.deepEqual([...new URL(link("/v1", { labels: {} }), "http://any").searchParams], []);
});

test("a floor is said as one text", () => {
  const words = (floor: number | Floor) =>
    new URL(client.url("walk", "glb", { controls, floor })).searchParams.get("floor")!;
  assert.equal(words(0.2), "0.2");
  assert.match(words({ height: 0.1, slope_x: 0, slope_z: 1e-7 }), /^0\.1,0,0\.0000001[0-9]*$/);
});
