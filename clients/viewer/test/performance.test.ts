/** Performances: scripts as text, reports as timelines, and faults at their places. */

import assert from "node:assert/strict";
import { test } from "node:test";

import { type PerformanceReport, Problem, Unreachable, WrongQuestion } from "@posefield/client";

import { faultsOf, lineOf, pretty, read, segmentOf, spanOf } from "../src/performance/script.ts";
import { bars, joinWords, lanes } from "../src/performance/timeline.ts";

const SCRIPT = {
  segments: [
    { kind: "walk", model: "w", along: [[0, 2] as const, [1, 5] as const] },
    { kind: "act", model: "a", controls: { "a/b~c": 1 } },
    { kind: "hold", seconds: 1.5 },
  ],
  fps: 24,
} as const;

test("a script is read again from both forms, with unknown fields", () => {
  const other = { ...SCRIPT, obstacles: [{ position: [1, 2], radius: 0.5 }], mood: [] };
  for (const text of [JSON.stringify(other), pretty(other as never)])
    assert.deepEqual(read(text), other);
  assert.match(pretty(SCRIPT as never), /^ {4}\{"kind": "hold", "seconds": 1\.5\}$/m);
});

test("a text that is no script is refused with the reason", () => {
  for (const [text, why] of [
    ["{", /not JSON/],
    ["[]", /an object with "segments"/],
    ['{"segments": []}', /one segment or more/],
    ['{"segments": [{"kind": "hold"}, {"kind": "run"}]}', /^\/segments\/1: expected/],
  ] as const)
    assert.match(String(read(text)), why);
});

test("a pointer leads to its place in the text", () => {
  const text = pretty(SCRIPT as never);
  const at = (pointer: string) => text.slice(...spanOf(text, pointer));
  assert.equal(at("/segments/2/seconds"), "1.5");
  assert.equal(at("/segments/0/along/1"), "[1, 5]");
  assert.equal(at("/segments/1/controls/a~1b~0c"), "1");
  assert.equal(at("/fps"), "24");
  assert.deepEqual(JSON.parse(at("/segments/1")), SCRIPT.segments[1]);
  assert.equal(lineOf(text, spanOf(text, "/segments/2")[0]), 5);
  // The nearest value around one that is missing.
  assert.equal(at("/segments/2/joint"), at("/segments/2"));
  assert.deepEqual(JSON.parse(at("")), SCRIPT);
});

test("segments are found by their pointers", () => {
  assert.equal(segmentOf("/segments/12/model"), 12);
  assert.equal(segmentOf("segments/1"), 1);
  for (const pointer of ["/fps", "", "/segments"]) assert.equal(segmentOf(pointer), null);
});

const REPORT = {
  duration: 10,
  segments: [
    { kind: "walk", model: "w@1", begins: 0, ends: 4 },
    { kind: "act", model: "a@1", begins: 4, ends: 5 },
    { kind: "hold", model: "a@1", begins: 5, ends: 10 },
  ],
  feet: {
    stances: [
      { joint: "L", begin: 0, end: 1 },
      { joint: "R", begin: 1, end: 2 },
      { joint: "L", begin: 3, end: 8 },
    ],
  },
} as unknown as PerformanceReport;

test("a report is bars and lanes over its duration", () => {
  assert.deepEqual(
    bars(REPORT).map(({ left, width, name }) => [left, width, name]),
    [
      [0, 40, "1 w"],
      [40, 10, "2 a"],
      [50, 50, "3 hold"],
    ],
  );
  assert.equal(bars(REPORT)[1]!.words, "2 a, act: 4.00 s to 5.00 s");
  const left = [
    { left: 0, width: 10 },
    { left: 30, width: 50 },
  ];
  assert.deepEqual(lanes(REPORT), [
    { joint: "L", spans: left },
    { joint: "R", spans: [{ left: 10, width: 10 }] },
  ]);
  assert.deepEqual(lanes({ ...REPORT, feet: undefined } as unknown as PerformanceReport), []);
});

test("a join is told with its figures, and a hard one as such", () => {
  const figures = { distance: 0.1, seconds: 0.5, peak: 7, usual: 8 };
  const join = { segment: 1, time: 4, blend: "dead", hard: false, ...figures };
  assert.equal(
    joinWords(join),
    "Join: poses 10 cm apart, blend dead over 0.50 s, peak 7 m/s² (else up to 8).",
  );
  assert.match(joinWords({ ...join, hard: true }), /^Hard join: .*captured\.$/);
});

function problem(status: number, type: string, errors: readonly object[]): Problem {
  const document = { type, title: "No", status, detail: "found, expected", instance: "1", errors };
  return new Problem(document as unknown as ConstructorParameters<typeof Problem>[0], null);
}

test("a refused script has its faults at their places; other faults are not the script's", () => {
  const places = [{ pointer: "/segments/0/speed", detail: "9 m/s" }];
  const refused = problem(422, "urn:posefield:problem:invalid-field", places);
  assert.deepEqual(faultsOf(refused), [
    { pointer: "/segments/0/speed", words: "9 m/s", fault: true },
  ]);
  assert.match(faultsOf(problem(400, "urn:posefield:problem:bad-body", []))![0]!.words, /found/);
  const wrong = faultsOf(new WrongQuestion("segment 2, Hold: found speed"));
  assert.equal(wrong![0]!.pointer, "/segments/2");
  assert.equal(faultsOf(problem(401, "urn:posefield:problem:unauthenticated", places)), null);
  assert.equal(faultsOf(problem(503, "urn:posefield:problem:overloaded", [])), null);
  assert.equal(faultsOf(new Unreachable("no answer")), null);
});
