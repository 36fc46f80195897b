/** The examples beside the contract: the client asks what they ask, and reads what they answer. */

import assert from "node:assert/strict";
import { readdirSync, readFileSync } from "node:fs";
import { test } from "node:test";

import type {
  ArchiveFormat,
  Client,
  ClipFormat,
  ClipQuestion,
  CrowdFormat,
  CrowdQuestion,
  NamedClipQuestion,
  NamedScript,
  PerformanceQuestion,
  PoseQuestion,
  SigmaQuestion,
  Target,
  WalkQuestion,
  WhyQuestion,
} from "../src/index.ts";
import { MEDIA_TYPES } from "../src/schema.ts";
import { observed } from "./service.ts";

const EXAMPLES = new URL("../../../api/examples/", import.meta.url);

type Ask = (client: Client, model: string, question: unknown) => Promise<unknown>;

const clips = (as: ArchiveFormat): Ask => {
  return (client, model, question) => {
    const { format, clips } = question as { format: ClipFormat; clips: NamedClipQuestion[] };
    return client.archive(model, format, clips, { as });
  };
};
const file = (format: ClipFormat): Ask => {
  return (client, model, question) => client.file(model, format, question as ClipQuestion);
};
const walk = (format: CrowdFormat): Ask => {
  return (client, model, question) => client.crowdFile(model, format, question as WalkQuestion);
};
const pose: Ask = (client, model, question) => client.pose(model, question as PoseQuestion);
const sigma: Ask = (client, model, question) => client.sigma(model, question as SigmaQuestion);
const why: Ask = (client, model, question) => client.why(model, question as WhyQuestion);

const clip: Ask = (client, model, question) => client.clip(model, question as ClipQuestion);
const crowd: Ask = (client, model, question) => client.crowd(model, question as CrowdQuestion);

const performance: Ask = (client, _, question) =>
  client.performance(question as PerformanceQuestion);
const performanceFile = (format: ClipFormat): Ask => {
  return (client, _, question) => client.performanceFile(format, question as PerformanceQuestion);
};
const performances = (as: "zip" | "tar"): Ask => {
  return (client, _, question) => {
    const { format, layout, scripts } = question as PerformancesQuestion;
    return client.performanceArchive(format, scripts, { as, layout });
  };
};
const plan: Ask = async (client, _, question) => ({
  trust: await client.plan(question as PerformanceQuestion),
});

interface PerformancesQuestion {
  readonly format: ClipFormat;
  readonly layout?: "whole" | "segments";
  readonly scripts: readonly NamedScript[];
}

/** Call by format; a text says why the client does not ask for it. */
type ByFormat = Readonly<Record<string, Ask | string>>;

const FILES = ["usda", "usdc", "usdz", "glb", "bvh", "json", "npz", "arrow"] as const;
const OTHER_TOOLS = "for readers of NumPy or Arrow; here the same numbers come as MessagePack";
const FOR_PEOPLE = "the same numbers as text, for people";
const SMALL = "a grid's JSON is small enough";
const POSES: ByFormat = { msgpack: pose, json: FOR_PEOPLE, npz: OTHER_TOOLS, arrow: OTHER_TOOLS };
const GRIDS: ByFormat = { json: sigma, msgpack: SMALL, npz: OTHER_TOOLS, arrow: OTHER_TOOLS };
const CLIPS: ByFormat = {
  ...Object.fromEntries(FILES.map((format) => [format, file(format)])),
  msgpack: clip,
};
const NEGOTIATED = "this client always names the format in the path";
const PAGE = "a page, for browsers";

const ASKED: Record<string, Ask | string | ByFormat> = {
  listModels: async (client) => ({ models: await client.models() }),
  listCharacters: (client) => client.characters(),
  getModel: (client, model) => client.card(model),
  getCharacter: (client, model) => client.character(model),
  getPose: NEGOTIATED,
  queryPose: NEGOTIATED,
  getPoseInFormat: POSES,
  queryPoseInFormat: POSES,
  getClip: NEGOTIATED,
  queryClip: NEGOTIATED,
  getClipInFormat: CLIPS,
  queryClipInFormat: CLIPS,
  queryClips: NEGOTIATED,
  queryClipsInFormat: { zip: clips("zip"), tar: clips("tar") },
  getCrowd: NEGOTIATED,
  queryCrowd: NEGOTIATED,
  getCrowdInFormat: { usda: walk("usda"), usdc: walk("usdc"), usdz: walk("usdz") },
  queryCrowdInFormat: { msgpack: crowd, json: FOR_PEOPLE, npz: OTHER_TOOLS, arrow: OTHER_TOOLS },
  getSigma: NEGOTIATED,
  querySigma: NEGOTIATED,
  getSigmaInFormat: GRIDS,
  querySigmaInFormat: GRIDS,
  getWhy: why,
  queryWhy: why,
  getSuggestions: (client, model, asked) => client.suggestions(model, asked as object),
  queryPerformance: plan,
  queryPerformanceInFormat: {
    ...Object.fromEntries(FILES.map((format) => [format, performanceFile(format)])),
    msgpack: performance,
  },
  queryPerformances: NEGOTIATED,
  queryPerformancesInFormat: { zip: performances("zip"), tar: performances("tar") },
  getReadiness: (client) => client.ready(),
  getLiveness: (client) => client.contract(),
  getMetrics: "read by Prometheus",
  getContract: "the contract is in this client's types",
  getContractJson: "only asked of services whose /livez says no version: see faults.test.ts",
  getDocs: PAGE,
  getProblems: PAGE,
  getViewer: PAGE,
};

interface Example {
  readonly method: "GET" | "POST";
  readonly path: string;
  readonly body?: unknown;
}

type Part = Readonly<Record<string, unknown>>;

/** An example, as tests/contract_examples.py reads it: what differs for a format, and its name filled in. */
function read(operation: string, part: string, format = ""): Part {
  const text = readFileSync(new URL(`${operation}/${part}.json`, EXAMPLES), "utf8");
  const { formats = {}, ...common } = JSON.parse(text.replaceAll("{format}", format)) as Part;
  const found: Record<string, unknown> = { ...common };
  for (const [names, own] of Object.entries(formats as Record<string, Part>))
    if (names.split(" ").includes(format))
      for (const [key, value] of Object.entries(own))
        found[key] = typeof value === "object" ? { ...(found[key] ?? {}), ...value } : value;
  return found;
}

test("every operation and format is asked for or left out for a reason", () => {
  assert.deepEqual(Object.keys(ASKED).sort(), readdirSync(EXAMPLES).sort());
  const formats = { ...POSES, ...CLIPS, zip: "", tar: "" };
  assert.deepEqual(Object.keys(formats).sort(), Object.keys(MEDIA_TYPES).sort());
});

const CASES = Object.entries(ASKED).flatMap(([operation, ask]) =>
  typeof ask === "object"
    ? Object.entries(ask).map(([format, own]) => [operation, format, own] as const)
    : [[operation, "", ask] as const],
);

for (const [operation, format, ask] of CASES) {
  if (typeof ask === "string") continue;
  test(`${operation} ${format}: the client asks as the example does, and reads the answer`, async () => {
    const example = read(operation, "request", format) as unknown as Example;
    // Whether a question travels as a link or as a body is its length's choice: here, the example's.
    const { client, sent } = observed(undefined, {
      longestLink: example.method === "GET" ? 2000 : 0,
    });
    const answer = await ask(client, modelOf(example.path), questionOf(example));
    assert.equal(sent[0]?.method, example.method);
    assert.deepEqual(parts(sent[0].path), parts(example.path));
    assert.deepEqual(sent[0].body, example.body ?? null);
    assert.deepEqual(new Set(sent.map((one) => one.status)), new Set([200]));
    const { body } = read(operation, "response", format);
    if (isSame(operation)) assertContains(answer, body);
  });
}

/** Whether the client's answer is the service's document. */
function isSame(operation: string): boolean {
  return /Why|Sigma|queryPerformance$|listModels|listCharacters|getModel|getReadiness/.test(
    operation,
  );
}

function modelOf(path: string): string {
  return /\/v1\/models\/([^/?]+)/.exec(path)?.[1] ?? "";
}

function parts(path: string): readonly [string, string[][]] {
  const { pathname, searchParams } = new URL(path, "http://any");
  return [pathname, [...searchParams].sort()];
}

const WORDS = /^(exact|extrapolate|performer|names|root|unit|up|across|along|instancing)$/;
const NUMBERS = /^(fps|start|end|level|nearest|columns|rows|margin|count|seconds|seed|motions)$/;

/** A target of JOINT@MOMENT:X,Y,Z. */
function target(words: string): Target {
  const [, joint, moment, place] = /^(.+)@(.+):(.+)$/.exec(words) ?? [];
  const position = (place ?? "").split(",").map(Number);
  const when = /^[a-z]/.test(moment ?? "") ? { at: moment as "end" } : { time: Number(moment) };
  return { joint: joint ?? "", position, ...when };
}

/** The question that a link asks, or the body. */
function questionOf(example: Example): unknown {
  if (example.method === "POST") return example.body;
  const found: Record<string, unknown> = {};
  const controls: Record<string, number> = {};
  const { searchParams } = new URL(example.path, "http://any");
  for (const [name, value] of searchParams) {
    if (WORDS.test(name)) found[name] = value;
    else if (NUMBERS.test(name)) found[name] = Number(value);
    else if (name === "target") found["targets"] = searchParams.getAll("target").map(target);
    else if (name === "loop") found[name] = value === "true";
    else if (name === "camera") found[name] = value.split(",").map(Number);
    else if (name === "time") found["times"] = searchParams.getAll("time").map(Number);
    else controls[name] = Number(value);
  }
  // Walking crowds and suggestions have no controls.
  const without = /\/(crowd|suggestions)\b/.test(example.path);
  return without ? found : { ...found, controls };
}

/** That an answer has what an excerpt of it has. */
function assertContains(whole: unknown, part: unknown): void {
  if (typeof part !== "object" || part === null) {
    assert.deepEqual(whole, part);
  } else {
    assert.ok(typeof whole === "object" && whole !== null, `found ${whole}`);
    const found = whole as Record<string, unknown>;
    for (const [key, value] of Object.entries(part)) assertContains(found[key], value);
  }
}

test("an answer that differs from its example is noticed", () => {
  assert.throws(() => assertContains({ a: [1, 2] }, { a: [1, 3] }));
  assert.throws(() => assertContains({}, { a: 1 }));
  assert.notDeepEqual(parts("/x?a=1&b=2"), parts("/x?a=1&b=3"));
});
