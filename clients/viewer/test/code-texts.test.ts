import assert from "node:assert/strict";
import { execFileSync } from "node:child_process";
import { describe, it } from "node:test";

import { curl, fileName, link, python, type Wanted } from "../src/code-texts.ts";

/** Names that would be something else to a shell, to a URL or to Python. */
const ODD = ["it's", 'a "b"', "$(touch /tmp/x)", "a&b=c", "lambda", "für\n", "fps", "\\", "`x`"];
const WANTED = {
  base: "http://127.0.0.1:8000",
  model: "cmu_walk@0123456789abcdef",
  format: "usdc",
  question: { controls: Object.fromEntries(ODD.map((name, i) => [name, i - 0.5])), loop: true },
} satisfies Wanted;

describe("texts that ask for a clip", () => {
  it("a link says every control as it is", () => {
    const { pathname, searchParams } = new URL(link(WANTED));
    assert.equal(pathname, "/v1/models/cmu_walk@0123456789abcdef/clip.usdc");
    for (const [i, name] of ODD.entries()) assert.equal(searchParams.get(name), String(i - 0.5));
    assert.equal(searchParams.get("loop"), "true");
  });

  it("curl's words are those that a shell hands on", () => {
    const words = shell(curl(WANTED));
    assert.deepEqual(words, ["--fail", "--output", fileName(WANTED), link(WANTED)]);
    const base = "http://it's";
    assert.equal(shell(curl({ ...WANTED, base }))[3], link({ ...WANTED, base }));
    assert.notDeepEqual(shell(curl(WANTED).replaceAll("'", "")), words);
  });

  it("Python reads the very names and numbers", () => {
    const asked = called(python(WANTED));
    assert.deepEqual(asked.controls, WANTED.question.controls);
    assert.equal(asked["loop"], true);
    const plain = { ...WANTED, question: { controls: { speed: 1.2, turn: -3e-7 } } };
    assert.deepEqual(called(python(plain)), plain.question);
    const labels = { style: "it's calm" };
    const labelled = { ...WANTED, question: { ...plain.question, labels } };
    assert.deepEqual(called(python(labelled)), labelled.question);
    assert.equal(new URL(link(labelled)).searchParams.get("label"), "style=it's calm");
  });

  it("a take and its feet are said to all, beside controls of the same names", () => {
    const controls = { take: 1.5, feet: 2 };
    const question = { controls, take: 7, variety: 0.3, detail: true, feet: "stand" } as const;
    const wanted: Wanted = { ...WANTED, question };
    assert.deepEqual(called(python(wanted)), question);
    const own = new URL(link({ ...wanted, question: { ...question, controls: {} } })).searchParams;
    assert.deepEqual(Object.fromEntries(own), {
      take: "7",
      variety: "0.3",
      detail: "true",
      feet: "stand",
    });
  });

  it("a crowd that walks has a link and a method of its own", () => {
    const question = { count: 50, seconds: 5, seed: 2, take: "index" } as const;
    const wanted: Wanted = { ...WANTED, question };
    assert.match(link(wanted), /crowd\.usdc\?count=50&seconds=5&seed=2&take=index$/);
    assert.equal(fileName(wanted), "crowd.usdc");
    assert.deepEqual(called(python(wanted)), question);
  });

  it("a file's name holds nothing that a path could mean", () => {
    assert.equal(fileName({ ...WANTED, model: "../it's" }), "___it_s.usdc");
  });
});

function shell(text: string): string[] {
  const said = execFileSync("sh", ["-c", `curl() { printf '%s\\0' "$@"; }\n${text}`]).toString();
  return said.split("\0").slice(0, -1);
}

/** The question to a stand-in for the client, as JSON of its keywords. */
function called(text: string): Record<string, unknown> {
  const stand = `
import json, sys, types
class Any:
    def __init__(self, *a): pass
    def __enter__(self): return self
    def __exit__(self, *a): pass
    def model(self, name): return self
    def clip(self, **given): print(json.dumps(given)); return self
    crowd_walk = clip
    def save(self, name): pass
sys.modules["posefield_client"] = types.SimpleNamespace(Client=Any)
exec(sys.stdin.read())
`;
  const python = process.env["PYTHON"] ?? "python3";
  return JSON.parse(execFileSync(python, ["-c", stand], { input: text }).toString());
}
