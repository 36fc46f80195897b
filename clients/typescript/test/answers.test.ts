/** Answers of the real service, as this client gives them. */

import assert from "node:assert/strict";
import { before, test } from "node:test";

import { Client, CONTRACT, type PoseQuestion, Problem, Script, type Target } from "../src/index.ts";
import { defaults, observed, URL_OF_SERVICE } from "./service.ts";

const client = new Client(URL_OF_SERVICE);
let question: PoseQuestion;

before(async () => {
  question = { controls: await defaults(client), times: [0, 0.1, 0.25] };
});

interface PoseDocument {
  readonly rotations: number[][][];
  readonly root_position: number[][];
  readonly bone_offsets: number[][];
  readonly times: number[];
}

test("poses are the numbers that the service says as text", async () => {
  const found = await client.pose("reach", question);
  const body = JSON.stringify(question);
  const headers = { "Content-Type": "application/json" };
  const init = { method: "POST", headers, body };
  const answer = await fetch(`${URL_OF_SERVICE}/v1/models/reach/pose.json`, init);
  const said = (await answer.json()) as PoseDocument;
  assert.deepEqual([...found.times], said.times);
  assert.deepEqual(found.rotations, Float32Array.from(said.rotations.flat(2)));
  assert.deepEqual(found.rootPosition, Float32Array.from(said.root_position.flat()));
  assert.deepEqual(found.boneOffsets, Float32Array.from(said.bone_offsets.flat()));
  assert.equal(found.trust.model, (await client.card("reach")).identity);
});

test("a motion that is held to targets says by how much it misses them", async () => {
  const { client, sent } = observed();
  const far: Target = { joint: "RightHand", position: [1e-7, 1, 5], at: "end" };
  const early = { joint: "LeftHand", position: [0.5, 1, 0], time: 0.25 };
  const { trust } = await client.pose("reach", { ...question, targets: [far, early] });
  const said = [...new URL(sent[0]!.path, "http://any").searchParams.getAll("target")];
  assert.match(said[0]!, /^RightHand@end:0\.0000001[0-9]*,1,5$/);
  assert.equal(said[1], "LeftHand@0.25:0.5,1,0");
  const [met] = trust.targets ?? [];
  assert.deepEqual(
    { ...met, miss: 0 },
    { what: "RightHand at end", miss: 0, unit: "m", reached: false },
  );
  assert.ok(met!.miss > 3);
  assert.equal(trust.warnings.length, 2);
  const refused = client.clip("reach", {
    controls: question.controls,
    targets: [far],
    exact: "none",
    extrapolate: "refuse",
  });
  await assert.rejects(refused, (fault: Problem) => fault.kind === "out-of-reach");
});

test("a clip is as long as its rate and frames say", async () => {
  const { controls } = question;
  const found = await client.clip("reach", { controls, fps: 25, unit: "cm" });
  assert.equal(found.frames, found.times.length);
  assert.equal(found.frames, 1 + Math.round(found.trust.duration * 25));
  assert.equal(found.rotations.length, found.frames * found.names.length * 4);
  assert.equal(found.units["length"], "centimetre");
  const metres = await client.clip("reach", { controls, fps: 25 });
  assert.ok(Math.abs(found.rootPosition[1]! - 100 * metres.rootPosition[1]!) < 1e-3);
});

test("a crowd has a pose for each character, and errors in pixels where there is a camera", async () => {
  const asked = { controls: question.controls, time: [0, 0.1, 0.2, 0.3, 0.4] };
  const plain = await client.crowd("reach", asked);
  assert.equal(plain.errorPx, null);
  assert.deepEqual(plain.levels, Int32Array.from([0, 0, 0, 0, 0]));
  const camera = { position: [0, 1.7, -40], fov: 0.9, height: 1080 };
  const seen = await client.crowd("reach", { ...asked, level: "auto", camera });
  assert.equal(seen.errorPx?.length, 5);
  assert.equal(seen.rotations.length, 5 * seen.names.length * 4);
});

test("a file says how far it may be trusted", async () => {
  const [first = ""] = Object.keys(question.controls);
  const far = { ...question.controls, [first]: question.controls[first]! * 1.5 };
  const found = await client.file("reach", "bvh", { controls: far });
  const { trust } = await client.pose("reach", { controls: far, times: [0] });
  assert.deepEqual(
    [found.name, found.mediaType, found.model],
    ["reach.bvh", "application/x-bvh", trust.model],
  );
  assert.deepEqual(found.warnings, trust.warnings);
  assert.equal(found.warnings.length, 1);
  assert.ok(Math.abs(found.sigma! - trust.sigma) < 1e-6);
  // A clip ends on a frame.
  assert.ok(Math.abs(found.duration! - trust.duration) < 0.5 / 30 + 1e-6);
});

test("a file says what was chosen for it, and what it misses", async () => {
  const { hip_height: _, ...controls } = question.controls;
  const far: Target = { joint: "RightHand", position: [0, 1, 9], at: "end" };
  const high: Target = { joint: "Head", position: [0, 9, 0], at: "start" };
  const asked = { controls, targets: [far, high] };
  const found = await client.file("reach", "bvh", asked);
  const { trust } = await client.pose("reach", { ...asked, times: [0] });
  assert.deepEqual(found.inferred, { hip_height: trust.controls["hip_height"] });
  const told = trust.targets!.map(({ what, unit }) => ({ what, unit }));
  assert.deepEqual(
    found.missed.map(({ what, unit }) => ({ what, unit })),
    told,
  );
  found.missed.forEach(({ miss }, i) => {
    assert.ok(Math.abs(miss - trust.targets![i]!.miss) < 1e-6);
  });
  const plain = await client.file("reach", "bvh", { controls: question.controls });
  assert.deepEqual([plain.inferred, plain.missed], [{}, []]);
});

test("a link gives the same file", async () => {
  const { controls } = question;
  const asked = { controls, fps: 60, performer: "tall", loop: false, end: null };
  const link = client.url("reach", "glb", asked);
  const answer = await fetch(link);
  assert.equal(answer.status, 200);
  const { content } = await client.file("reach", "glb", asked);
  assert.deepEqual(new Uint8Array(await answer.arrayBuffer()), content);
});

test("the service is ready, and speaks this client's version", async () => {
  const { models } = await client.ready();
  assert.deepEqual(
    models.map((identity) => identity.split("@")[0]),
    ["reach", "walk"],
  );
  assert.equal(await client.contract(), CONTRACT);
});

test("a refusal says what, where and under which id", async () => {
  const asked = client.pose("reach", { ...question, times: [1e6] });
  const problem: unknown = await asked.catch((fault) => fault);
  assert.ok(problem instanceof Problem);
  assert.deepEqual([problem.status, problem.kind], [422, "invalid-field"]);
  assert.equal(problem.places[0]?.parameter, "time");
  assert.match(problem.message, /times\/0: 1000000 s, expected 0 to/);
  assert.match(problem.requestId, /^[\w.-]+$/);
});

test("a body's fault is pointed at", async () => {
  const controls = { spin: 1.7 };
  const body = observed(undefined, { longestLink: 0 }).client;
  await assert.rejects(body.pose("reach", { controls, times: [0] }), (fault: unknown) => {
    return fault instanceof Problem && fault.places[0]?.pointer?.startsWith("/controls") === true;
  });
});

test("a performance has the timeline of its plan, as numbers and as a file", async () => {
  const script = new Script().walk("walk", { to: [0, 2] }).walk({ seconds: 1, turn: 0.3 });
  const found = await client.performance(script.question({ fps: 24 }));
  const planned = await client.plan(script.question({ fps: 24 }));
  assert.equal(found.frames, planned.frames);
  assert.deepEqual(found.trust.segments, planned.segments);
  const file = await client.performanceFile("usdc", script, { layout: "segments" });
  assert.equal(text(file, 8), "PXR-USDC");
  const wrong = new Script().walk("walk", { seconds: 1 }).act("reech");
  await assert.rejects(client.performanceArchive("bvh", [script, wrong]), (fault) => {
    assert.ok(fault instanceof Problem);
    return fault.places[0]?.pointer === "/scripts/1/segments/1/model";
  });
});

test("archives and crowds come as files, with progress", async () => {
  const { controls } = question;
  const script = new Script().walk("walk", { seconds: 1 });
  const steps: number[] = [];
  const onProgress = ({ received }: { received: number }) => steps.push(received);
  for (const [asked, name, head] of [
    [client.archive("reach", "bvh", [{ controls }], { onProgress }), "reach.zip", "PK"],
    [client.performanceArchive("bvh", [script], { onProgress }), "performances.zip", "PK"],
    [client.crowdFile("walk", "usdc", { count: 3 }, { onProgress }), "walk.usdc", "PXR-USDC"],
  ] as const) {
    const found = await asked;
    assert.deepEqual([found.name, text(found, head.length)], [name, head]);
    assert.ok(steps.includes(found.content.length));
  }
});

function text({ content }: { content: Uint8Array }, length: number): string {
  return new TextDecoder().decode(content.subarray(0, length));
}
