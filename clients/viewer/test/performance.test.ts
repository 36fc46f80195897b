/** Performances: scripts that are edited, plans as timelines, and faults at their places. */

import assert from "node:assert/strict";
import { test } from "node:test";

import { Problem, Unreachable } from "@posefield/client";

import { faultsOf, performed, type Report } from "../src/performance/answers.ts";
import { curved } from "../src/performance/fields.ts";
import { beyond, rerouted, wayOf } from "../src/performance/path-fields.ts";
import * as script from "../src/performance/script.ts";
import { bars, joinWords, lanes, marks, notesOf, within } from "../src/performance/timeline.ts";

const WALK: script.Walk = {
  kind: "walk",
  model: "w",
  along: [
    [0, 2],
    [1, 5],
  ],
};
const ACT: script.Act = { kind: "act", model: "a" };
const HOLD: script.Hold = { kind: "hold", seconds: 1.5 };
const SCRIPT: script.Script = { segments: [WALK, ACT, HOLD], fps: 24 };
const kinds = ({ segments }: script.Script) => segments.map(({ kind }) => kind).join();

test("what is written is read again, in both forms, unknown fields too", () => {
  const other = { ...SCRIPT, obstacles: [{ position: [1, 2] as const, radius: 0.5 }], mood: [] };
  for (const text of [script.compact(other), script.pretty(other)])
    assert.deepEqual(script.read(text), other);
  assert.match(script.pretty(SCRIPT), /^ {4}\{"kind": "hold", "seconds": 1\.5\}$/m);
});

test("what is no script says why", () => {
  for (const [text, why] of [
    ["{", /not JSON/],
    ["[]", /an object with "segments"/],
    ['{"segments": []}', /one segment or more/],
    ['{"segments": [{"kind": "hold"}, {"kind": "run"}]}', /^\/segments\/1: expected/],
  ] as const)
    assert.match(String(script.read(text)), why);
});

test("segments are added, moved, replaced and deleted, and nothing else changes", () => {
  assert.equal(kinds(script.added(SCRIPT, 0, HOLD)), "walk,hold,act,hold");
  assert.equal(kinds(script.moved(SCRIPT, 2, -1)), "walk,hold,act");
  assert.equal(script.moved(SCRIPT, 0, -1), SCRIPT);
  assert.equal(kinds(script.removed(SCRIPT, 0)), "act,hold");
  assert.equal(kinds(script.replaced(SCRIPT, 1, HOLD)), "walk,hold,hold");
  assert.equal(kinds(SCRIPT), "walk,act,hold");
  assert.equal(script.added(SCRIPT, 0, HOLD).fps, 24);
});

test("a field that says nothing is taken away, and others keep their order", () => {
  assert.deepEqual(script.put(HOLD, "joint", "Hand"), { ...HOLD, joint: "Hand" });
  assert.deepEqual(Object.keys(script.put(WALK, "model", "v")), ["kind", "model", "along"]);
  for (const nothing of [undefined, null, {}, []])
    assert.deepEqual(script.put(WALK, "along", nothing), { kind: "walk", model: "w" });
  assert.deepEqual(script.put(HOLD, "seconds", 0), { kind: "hold", seconds: 0 });
});

test("a walk takes another way and keeps where it leads", () => {
  const to = rerouted(WALK, "to", [9, 9]);
  assert.deepEqual(to, { kind: "walk", model: "w", to: [1, 5] });
  assert.deepEqual(rerouted(to, "along", [9, 9]).along, [[1, 5]]);
  const timed = rerouted({ ...WALK, speed: 1 }, "seconds", [9, 9]);
  assert.deepEqual(timed, { kind: "walk", model: "w", speed: 1, seconds: 3 });
  assert.deepEqual(rerouted({ ...timed, turn: 0.2 }, "to", [9, 9]).to, [9, 9]);
  assert.ok(!("turn" in rerouted({ ...timed, turn: 0.2 }, "next", [9, 9])));
  for (const way of ["along", "to", "seconds", "next"] as const)
    assert.equal(wayOf(rerouted(WALK, way, [0, 3])), way);
});

test("points are drawn on: a walk to a point stays straight, others go along", () => {
  assert.deepEqual(script.through({ ...ACT, kind: "walk", to: [1, 1] }, [[2, 2]]).to, [2, 2]);
  const timed: script.Walk = { kind: "walk", model: "w", seconds: 3, turn: 0.1 };
  assert.deepEqual(script.through(timed, [[2, 2]]), { kind: "walk", model: "w", along: [[2, 2]] });
  assert.deepEqual(script.points({ ...WALK, along: "x" as never }), []);
  assert.deepEqual(beyond([]), [0, 2]);
  const [x, z] = beyond([
    [0, 0],
    [3, 4],
  ]);
  assert.ok(Math.abs(Math.hypot(x - 3, z - 4) - 2) < 0.01);
});

test("a number or a curve is read, and what is neither says so", () => {
  assert.equal(curved("1.2"), 1.2);
  assert.deepEqual(curved("0:0.8, 4:1.4"), [
    [0, 0.8],
    [4, 1.4],
  ]);
  for (const wrong of ["fast", "0:x", "0:", ":1", "0:1,"])
    assert.equal(typeof curved(wrong), "string");
});

const REPORT: Report = {
  character: "a@1",
  duration: 10,
  sigma: 0.1,
  supported: true,
  segments: [
    { kind: "walk", model: "w@1", begins: 0, ends: 4, place: [0, 0], heading: 0 },
    { kind: "act", model: "a@1", begins: 4, ends: 5, place: [0, 4], heading: 0 },
    { kind: "hold", model: "a@1", begins: 5, ends: 10, place: [0, 4], heading: 0 },
  ],
  joins: [
    {
      segment: 1,
      time: 4,
      distance: 0.1,
      blend: "dead",
      seconds: 0.5,
      peak: 7,
      usual: 8,
      hard: false,
    },
  ],
  feet: {
    stances: [
      { joint: "L", begin: 0, end: 1 },
      { joint: "R", begin: 1, end: 2 },
      { joint: "L", begin: 3, end: 8 },
    ],
  },
  warnings: [],
};

test("a plan is bars, marks and lanes over its duration", () => {
  const found = bars(REPORT);
  assert.deepEqual(
    found.map(({ left, width, sign }) => [left, width, sign]),
    [
      [0, 40, "1 w"],
      [40, 10, "2 a"],
      [50, 50, "3 hold"],
    ],
  );
  assert.equal(found[1]!.words, "2 a, act: 4.00 s to 5.00 s");
  assert.deepEqual(
    marks(REPORT).map(({ left, hard }) => [left, hard]),
    [[40, false]],
  );
  assert.deepEqual(lanes(REPORT), [
    {
      joint: "L",
      stays: [
        { left: 0, width: 10 },
        { left: 30, width: 50 },
      ],
    },
    { joint: "R", stays: [{ left: 10, width: 10 }] },
  ]);
  assert.deepEqual(lanes({ ...REPORT, feet: undefined } as unknown as Report), []);
});

test("a join is said with its figures, and a hard one as such", () => {
  const [join] = REPORT.joins;
  const said = joinWords(join!);
  assert.match(
    said,
    /^Join: poses 10 cm apart, blend dead over 0\.50 s, peak 7 m\/s² \(else up to 8\)\.$/,
  );
  assert.match(joinWords({ ...join!, hard: true }), /^Hard join: .*captured\.$/);
});

test("notes are those of their segment; what points nowhere is general", () => {
  const note = (pointer: string) => ({ pointer, words: pointer, fault: true });
  const notes = ["/segments/1/model", "/segments/12", "segments/1", "/fps", ""].map(note);
  const words = (segment: number | null) => notesOf(notes, segment, 3).map((each) => each.words);
  assert.deepEqual(words(1), ["/segments/1/model", "segments/1"]);
  assert.deepEqual(words(0), []);
  assert.deepEqual(words(null), ["/segments/12", "/fps", ""]);
  assert.equal(notesOf([note("/fps"), note("/fps")], null, 1).length, 1);
  assert.equal(within("/segments/1/targets/0/joint"), "targets/0/joint");
});

function problem(status: number, type: string, errors: readonly object[]): Problem {
  const said = { type, title: "No", status, detail: "found, expected", instance: "1", errors };
  return new Problem(said as unknown as ConstructorParameters<typeof Problem>[0], null);
}

test("a refused script is told at its places, other faults are not the script's", () => {
  const places = [{ pointer: "/segments/0/speed", detail: "9 m/s" }];
  const refused = problem(422, "urn:posefield:problem:invalid-field", places);
  assert.deepEqual(faultsOf(refused), [
    { pointer: "/segments/0/speed", words: "9 m/s", fault: true },
  ]);
  assert.match(faultsOf(problem(400, "urn:posefield:problem:bad-body", []))![0]!.words, /found/);
  const older = faultsOf(problem(404, "urn:posefield:problem:no-such-path", []));
  assert.match(older![0]!.words, /older than performances/);
  assert.equal(faultsOf(problem(401, "urn:posefield:problem:unauthenticated", places)), null);
  assert.equal(faultsOf(problem(503, "urn:posefield:problem:overloaded", [])), null);
  assert.equal(faultsOf(new Unreachable("no answer")), null);
});

test("a motion's numbers lie as those of clips do", () => {
  const { offsets, track } = performed({
    trust: REPORT,
    names: ["a", "b"],
    parents: [-1, 0],
    rate: 30,
    times: [0, 1 / 30],
    rotations: [
      [
        [1, 0, 0, 0],
        [0, 1, 0, 0],
      ],
      [
        [0, 0, 1, 0],
        [0, 0, 0, 1],
      ],
    ],
    root_position: [
      [0, 1, 0],
      [0, 1, 2],
    ],
    bone_offsets: [
      [0, 0, 0],
      [0, 3, 0],
    ],
  });
  assert.deepEqual([...track.rotations], [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1]);
  assert.deepEqual([...track.rootPosition], [0, 1, 0, 0, 1, 2]);
  assert.deepEqual([...offsets], [0, 0, 0, 0, 3, 0]);
});
