/** Scripts and performances: what the builders make, what is refused, what the service says of them. */

import assert from "node:assert/strict";
import { test } from "node:test";

import { Client, type PerformanceQuestion, Problem, Script, WrongQuestion } from "../src/index.ts";
import { observed, URL_OF_SERVICE } from "./service.ts";

const client = new Client(URL_OF_SERVICE);
const hand = { joint: "rhand", position: [0.4, 1.6, 4.6], at: "event" } as const;
const whole = new Script()
  .walk("cmu_walk", {
    along: [
      [0, 2],
      [0.5, 4],
    ],
    speed: 1.2,
    start: "standing",
  })
  .act("grab", { targets: [{ ...hand, position: [...hand.position] }] })
  .hold(0.5, { joint: "rhand", look_at: [0, 1.6, 6] })
  .act("grab_return", { join: { seconds: 0.4 } })
  .walk({ seconds: 3, turn: 0.2 });
const walks = new Script().walk("walk", { to: [0, 2] }).walk({ seconds: 1, turn: 0.3 });

test("builders make the document of the contract", () => {
  assert.deepEqual(whole.question({ fps: 60 }), {
    segments: [
      {
        kind: "walk",
        model: "cmu_walk",
        along: [
          [0, 2],
          [0.5, 4],
        ],
        speed: 1.2,
        start: "standing",
      },
      { kind: "act", model: "grab", targets: [hand] },
      { kind: "hold", seconds: 0.5, joint: "rhand", look_at: [0, 1.6, 6] },
      { kind: "act", model: "grab_return", join: { seconds: 0.4 } },
      { kind: "walk", model: "cmu_walk", seconds: 3, turn: 0.2 },
    ],
    fps: 60,
  });
});

test("a script is never changed", () => {
  const begun = new Script().walk("a", { seconds: 1 });
  assert.notDeepEqual(begun.hold(1), begun);
  assert.equal(begun.segments.length, 1);
});

test("a performance has the timeline of its plan", async () => {
  const { client, sent } = observed();
  const question = walks.question({ fps: 24 });
  const found = await client.performance(question);
  const planned = await client.plan(question);
  assert.deepEqual(
    sent.map(({ method, path }) => `${method} ${path}`),
    ["POST /v1/performances.msgpack", "POST /v1/performances?plan=true"],
  );
  assert.equal(found.frames, planned.frames);
  assert.deepEqual(found.trust.segments, planned.segments);
  assert.equal(found.rotations.length, 4 * found.frames * found.names.length);
  assert.equal(found.rate, 24);
  assert.deepEqual(
    planned.segments.map(({ kind }) => kind),
    ["walk", "walk"],
  );
});

test("a performance as a file", async () => {
  const found = await client.performanceFile("usdc", walks);
  assert.equal(new TextDecoder().decode(found.content.slice(0, 8)), "PXR-USDC");
  assert.ok((found.duration ?? 0) > 1 && found.sigma !== null && found.supported);
});

test("segments are a layout of USD", async () => {
  const { client, sent } = observed();
  const found = await client.performanceFile("usda", walks, { layout: "segments" });
  assert.equal(sent[0]?.path, "/v1/performances.usda?layout=segments");
  assert.ok(new TextDecoder().decode(found.content).includes('def Scope "Segments"'));
  await assert.rejects(client.performanceFile("glb", walks, { layout: "segments" }), Problem);
});

test("an archive has every performance under its name", async () => {
  const { client, sent } = observed();
  const scripts = [{ name: "first", ...walks.question({ fps: 24 }) }, walks];
  const found = await client.performanceArchive("bvh", scripts, { as: "tar" });
  assert.equal(sent[0]?.path, "/v1/performances/batch.tar");
  assert.deepEqual([...found.files.keys()], ["first.bvh", "performance-000001.bvh"]);
  const alone = await client.performanceFile("bvh", walks);
  assert.deepEqual(found.files.get("performance-000001.bvh"), alone.content);
  const planned = await client.plan(walks);
  assert.deepEqual(found.entries[1]?.segments, planned.segments);
  assert.ok((found.entries[0]?.frames ?? 0) < planned.frames);
  const parts = await client.performanceArchive("usda", [walks], { layout: "segments" });
  assert.ok(new TextDecoder().decode(parts.files.get("performance-000000.usda")).includes("s001"));
});

test("the service points at a script of an archive", async () => {
  const wrong = new Script().walk("walk", { seconds: 1 }).act("reech");
  await assert.rejects(client.performanceArchive("bvh", [walks, wrong]), (fault) => {
    assert.ok(fault instanceof Problem);
    return fault.places[0]?.pointer === "/scripts/1/segments/1/model";
  });
});

test("the service points at the part of a script", async () => {
  const wrong = new Script().walk("walk", { seconds: 1 }).act("reech");
  await assert.rejects(client.plan(wrong), (fault) => {
    assert.ok(fault instanceof Problem);
    return fault.places[0]?.pointer === "/segments/1/model";
  });
});

const asked = (question: object): PerformanceQuestion => question as PerformanceQuestion;
const WRONG: Readonly<Record<string, [() => unknown, string]>> = {
  model: [() => new Script().walk({ seconds: 1 }), "a walk without a model, expected one in the"],
  walk: [
    () => new Script().walk("a", { seconds: 1, ...{ sped: 1 } }),
    "segment 0, Walk: found sped (did you mean speed?)",
  ],
  act: [
    () => new Script().act("a", { exact: "none", ...{ facng: 1 } }),
    "Act: found facng (did you mean facing?)",
  ],
  hold: [
    () => new Script().hold(1, { look_at: [0, 1, 2], ...{ jont: "a" } }),
    "Hold: found jont (did you mean joint?)",
  ],
  join: [
    () => new Script().act("a", { join: { blend: "dead", ...{ secnds: 1 } } }),
    "segment 0, Join: found secnds (did you mean seconds?)",
  ],
  target: [
    () => new Script().act("a", { targets: [{ joint: "b", position: [0, 0, 0] }] }),
    "segment 0: expected one of time and at in each target",
  ],
  placed: [
    () =>
      new Script().act("a", {
        targets: [{ joint: "b", position: [0, 0, 0], at: "end", ...{ fram: "world" } }],
      }),
    "PlacedTarget: found fram (did you mean frame?)",
  ],
  kind: [
    () => client.plan(asked({ segments: [{ kind: "run", model: "a" }] })),
    "segment 0: found the kind run, expected walk, act or hold",
  ],
  none: [() => client.plan(new Script()), "a script without segments, expected at least one"],
  option: [
    () => client.performance(walks.question({ take: 1, ...{ fsp: 30 } })),
    "PerformanceQuestion: found fsp (did you mean fps?)",
  ],
  named: [
    () => client.performanceArchive("usdc", [{ ...walks.question(), ...{ nam: "a" } }]),
    "NamedScript: found nam (did you mean name?)",
  ],
  as: [
    () => client.performanceArchive("usdc", [walks], { as: "zip", ...{ ass: "tar" } }),
    "TransferOptions: found ass",
  ],
  number: [
    () => client.performanceFile("glb", new Script().hold(Number.NaN)),
    "seconds: found NaN, expected a finite number",
  ],
};

for (const [name, [ask, said]] of Object.entries(WRONG)) {
  test(`what cannot be is not sent: ${name}`, async () => {
    await assert.rejects(
      async () => ask(),
      (fault) => fault instanceof WrongQuestion && fault.message.includes(said),
    );
  });
}
