/** Questions and scripts as requests, and those that cannot be sent. */

import assert from "node:assert/strict";
import { test } from "node:test";

import { Client, Script, WrongQuestion } from "../src/index.ts";
import { link, request, under } from "../src/questions.ts";
import { serving } from "./service.ts";

const HAND = { joint: "RightHand", position: [0, 1, 0] };
const CONTROLS = { turn: 1, "hip height": 2 };

test("a question as a link has a parameter for each control, time, target and label", () => {
  const asked = link("/clip", {
    controls: CONTROLS,
    times: [0, 0.5],
    targets: [
      { ...HAND, position: [1e-7, 1, 5], at: "end" },
      { ...HAND, time: 0.25 },
    ],
    labels: { style: { angry: 0.75, happy: 0.25 }, performer: "kim" },
    floor: { height: 0.1, slope_x: 0, slope_z: 0 },
    exact: ["turn", "b"],
    fps: undefined,
    loop: false,
    camera: [0, 1.7, -60],
  });
  const query = new URL(asked, "http://any").searchParams;
  assert.match(query.getAll("target")[0]!, /^RightHand@end:0\.0000001[0-9]*,1,5$/);
  query.delete("target", query.getAll("target")[0]!);
  assert.deepEqual(
    [...query],
    [
      ["turn", "1"],
      ["hip height", "2"],
      ["time", "0"],
      ["time", "0.5"],
      ["target", "RightHand@0.25:0,1,0"],
      ["label", "style=angry:0.75,happy:0.25"],
      ["label", "performer=kim"],
      ["floor", "0.1,0,0"],
      ["exact", "turn,b"],
      ["loop", "false"],
      ["camera", "0,1.7,-60"],
    ],
  );
});

test("a long question is a body", () => {
  const times = Array.from({ length: 300 }, (_, index) => index / 1000);
  const { method, body } = request("/pose", { controls: CONTROLS, times }, 2000);
  assert.deepEqual([method, JSON.parse(body!)], ["POST", { controls: CONTROLS, times }]);
  assert.equal(request("/pose", { controls: CONTROLS, times }, 7000).method, "GET");
});

test("a name is one part of a path, whatever is in it", () => {
  assert.equal(under("walk/../reach?x#y", ""), "/v1/models/walk%2F..%2Freach%3Fx%23y");
  assert.equal(under("reach@0123456789abcdef", "/why"), "/v1/models/reach@0123456789abcdef/why");
});

test("a number that is not finite is not sent", async () => {
  let count = 0;
  const counting: typeof fetch = async () => Response.json({ count: count++ });
  const client = new Client("", { fetch: counting });
  for (const number of [Number.NaN, -Infinity]) {
    const controls = { turn: number };
    const target = { ...HAND, time: number };
    for (const ask of [
      () => client.clip("reach", { controls }),
      () => client.clip("reach", { controls: {}, targets: [target] }),
      () => client.crowd("reach", { controls: {}, time: [0, number] }),
      () => client.crowdFile("walk", "usdc", { camera: [number, 0, 0] }),
    ]) {
      await assert.rejects(ask, (fault) => {
        assert.ok(fault instanceof WrongQuestion);
        return fault.message.includes(`found ${number}, expected a finite number`);
      });
    }
  }
  assert.equal(count, 0);
});

test("a key that no header can hold is refused without being said", () => {
  for (const key of ["top\nsecret", "top secret", "topsecret\u00e9"]) {
    assert.throws(
      () => new Client("", { key }),
      (fault) => fault instanceof WrongQuestion && !/top|secret/.test(`${fault.stack}`),
    );
  }
});

test("an address that is none is refused", async () => {
  for (const base of ["nonsense", "ftp://a", "http://", "http://u:p@a", "http://a?b"])
    assert.throws(() => new Client(base), WrongQuestion, base);
  await serving(
    (_, answer) => answer.end('{"models":[]}'),
    async (base, asked) => {
      for (const address of [base, `${base}/`, `${base}/under/`])
        await new Client(address).models();
      assert.deepEqual(asked, ["/v1/models", "/v1/models", "/under/v1/models"]);
    },
  );
});

test("builders make the document of the contract, and change no script", () => {
  const begun = new Script().walk("cmu_walk", { to: [0, 3], start: "standing" });
  const whole = begun
    .act("grab", { targets: [{ ...HAND, at: "event" }] })
    .hold(0.5, { joint: "rhand", look_at: [0, 1.6, 6] })
    .walk({ seconds: 3, turn: 0.2 });
  assert.equal(begun.segments.length, 1);
  assert.deepEqual(whole.question({ fps: 60 }), {
    segments: [
      { kind: "walk", model: "cmu_walk", to: [0, 3], start: "standing" },
      { kind: "act", model: "grab", targets: [{ ...HAND, at: "event" }] },
      { kind: "hold", seconds: 0.5, joint: "rhand", look_at: [0, 1.6, 6] },
      { kind: "walk", model: "cmu_walk", seconds: 3, turn: 0.2 },
    ],
    fps: 60,
  });
  assert.throws(() => new Script().walk({ seconds: 1 }), /a walk without a model, expected one/);
});
