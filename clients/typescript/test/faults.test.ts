/** Faults of servers that really have them: each has its class of error, and some pass. */

import assert from "node:assert/strict";
import type { ServerResponse } from "node:http";
import { test } from "node:test";
import { gzipSync } from "node:zlib";

import {
  Broken,
  Client,
  type ClientOptions,
  CONTRACT,
  PosefieldError,
  Problem,
  type Progress,
  TimedOut,
  Unexpected,
  Unreachable,
} from "../src/index.ts";
import { type Handler, observed, serving } from "./service.ts";

const QUICK: ClientOptions = { pause: 1, timeout: 5000 };
const MODELS = JSON.stringify({ models: [] });
const CLIP = { controls: { stature: 1.7 } };

function json(answer: ServerResponse, content: string, status = 200): void {
  answer.writeHead(status, { "Content-Type": "application/json" }).end(content);
}

/** The head of a clip's file. */
function file(answer: ServerResponse, more = {}): ServerResponse {
  return answer.writeHead(200, { "Content-Type": "application/x-bvh", ...more });
}

function refuse(answer: ServerResponse, kind: string, status: number, more = {}): void {
  const document = {
    type: `urn:posefield:problem:${kind}`,
    title: "No",
    status,
    detail: "found this, expected that",
    instance: "id-1",
    errors: [],
  };
  const headers = { "Content-Type": "application/problem+json", ...more };
  answer.writeHead(status, headers).end(JSON.stringify(document));
}

/** Fails some requests in a way, and answers the others. */
function failing(times: number, fail: (answer: ServerResponse) => void): Handler {
  return (_, answer, count) => (count < times ? fail(answer) : json(answer, MODELS));
}

async function fault(asked: Promise<unknown>): Promise<unknown> {
  return asked.then(
    () => assert.fail("there was an answer"),
    (found: unknown) => found,
  );
}

async function faultOf<Kind extends PosefieldError>(
  kind: new (...words: never[]) => Kind,
  asked: Promise<unknown>,
): Promise<Kind> {
  const found = await fault(asked);
  assert.ok(found instanceof kind, `found ${found}`);
  assert.ok(found instanceof PosefieldError);
  return found;
}

test("a service that is down is unreachable, after asking again", async () => {
  let base = "";
  await serving(failing(0, refuse503), async (own) => {
    base = own;
  });
  let asked = 0;
  const counting: typeof fetch = (...words) => {
    asked++;
    return fetch(...words);
  };
  const client = new Client(base, { ...QUICK, retries: 2, fetch: counting });
  const found = await faultOf(Unreachable, client.models());
  assert.equal(found.name, "Unreachable");
  assert.match(found.message, /127\.0\.0\.1:\d+ does not answer/);
  assert.equal(asked, 3);
});

function refuse503(answer: ServerResponse): void {
  refuse(answer, "overloaded", 503);
}

const PASSING: Record<string, (answer: ServerResponse) => void> = {
  "has too much to do": refuse503,
  "restarts: connections end": (answer) => answer.destroy(),
  "restarts behind a proxy": (answer) => answer.writeHead(502).end("<h1>Bad Gateway</h1>"),
  "is behind a gate that describes problems in its own way": (answer) => {
    answer.writeHead(503, { "Content-Type": "application/problem+json" }).end('{"title":"Busy"}');
  },
  "is behind a gate that counts": (answer) => answer.writeHead(429).end(),
  "is cut in the middle": (answer) => {
    answer.writeHead(200, { "Content-Length": "14" });
    answer.write('{"mod', () => answer.destroy());
  },
};

for (const [what, fail] of Object.entries(PASSING)) {
  test(`a service that ${what}, then is well, is asked again`, async () => {
    await serving(failing(2, fail), async (base, asked) => {
      assert.deepEqual(await new Client(base, QUICK).models(), []);
      assert.equal(asked.length, 3);
    });
  });
}

test("nothing is asked again that will not change", async () => {
  const fail = (answer: ServerResponse) => refuse(answer, "invalid-field", 422);
  await serving(failing(1, fail), async (base, asked) => {
    const found = await faultOf(Problem, new Client(base, QUICK).models());
    assert.deepEqual([found.kind, found.status, found.requestId], ["invalid-field", 422, "id-1"]);
    assert.equal(asked.length, 1);
  });
});

test("the service says how long to wait", async () => {
  const fail = (answer: ServerResponse) => refuse(answer, "late", 503, { "Retry-After": "1" });
  await serving(failing(1, fail), async (base) => {
    const began = performance.now();
    await new Client(base, QUICK).models();
    assert.ok(performance.now() - began >= 990);
    const found = await faultOf(
      Problem,
      serving(failing(1, fail), (own) =>
        new Client(own, { retries: 0 }).models().then(() => undefined),
      ),
    );
    assert.deepEqual([found.kind, found.retryAfter], ["late", 1]);
  });
});

test("nobody waits an hour, nor until tomorrow", async () => {
  const tomorrow = new Date(Date.now() + 86_400_000).toUTCString();
  for (const after of ["3600", tomorrow]) {
    const fail = (answer: ServerResponse) => refuse(answer, "late", 503, { "Retry-After": after });
    await serving(failing(1, fail), async (base, asked) => {
      const found = await faultOf(Problem, new Client(base, QUICK).models());
      assert.ok(found.retryAfter! > 3000);
      assert.equal(asked.length, 1);
    });
  }
});

test("a service that says nothing has its time, once", async () => {
  await serving(
    () => {},
    async (base, asked) => {
      await faultOf(TimedOut, new Client(base, { ...QUICK, timeout: 500 }).models());
      assert.equal(asked.length, 1);
    },
  );
});

test("who wants to wait for ever may", async () => {
  const late: Handler = (_, answer) => setTimeout(() => json(answer, MODELS), 30);
  await serving(late, async (base) => {
    assert.deepEqual(await new Client(base, { timeout: Infinity }).models(), []);
  });
});

test("a clip that stops coming has its time, once", async () => {
  const begin: Handler = (_, answer) => file(answer).write("BVH");
  await serving(begin, async (base, asked) => {
    const client = new Client(base, { ...QUICK, timeout: 500 });
    const found = await faultOf(TimedOut, client.file("reach", "bvh", CLIP));
    assert.match(found.message, /after 3 bytes/);
    assert.equal(asked.length, 1);
  });
});

for (const framed of ["by its length", "in chunks"]) {
  test(`a clip that is cut in the middle, sent ${framed}, is broken`, async () => {
    const cut: Handler = (_, answer) => {
      file(answer, framed === "in chunks" ? {} : { "Content-Length": "1000" });
      answer.write("x".repeat(100), () => answer.destroy());
    };
    await serving(cut, async (base, asked) => {
      const client = new Client(base, { ...QUICK, retries: 1 });
      const found = await faultOf(Broken, client.file("reach", "bvh", CLIP));
      assert.match(found.message, /ended after \d+ bytes/);
      assert.ok(found instanceof Unreachable);
      assert.equal(asked.length, 2);
    });
  });
}

test("a newer service may say what this client has no word for", async () => {
  const fail = (answer: ServerResponse) => refuse(answer, "full-moon", 409);
  await serving(failing(9, fail), async (base) => {
    const found = await faultOf(Problem, new Client(base, QUICK).models());
    assert.deepEqual([found.kind, found.type], ["other", "urn:posefield:problem:full-moon"]);
  });
});

/** A service of another version. */
function other(first: (answer: ServerResponse) => void): Handler {
  return ({ url }, answer) =>
    url === "/livez" ? json(answer, '{"status":"live","contract":"9.1.0"}') : first(answer);
}

const STRANGE: Record<string, (answer: ServerResponse) => void> = {
  "a page": (answer) => answer.writeHead(200, { "Content-Type": "text/html" }).end("<html>"),
  "another document": (answer) => json(answer, '{"modelle":[]}'),
  "a number for a list": (answer) => json(answer, '{"models":5}'),
  "no path of the contract": (answer) => refuse(answer, "no-such-path", 404),
  "a status without a word": (answer) => answer.writeHead(418).end(),
  "an answer elsewhere": (answer) => answer.writeHead(307, { Location: "/elsewhere" }).end(),
};

for (const [what, first] of Object.entries(STRANGE)) {
  test(`an answer that is ${what} is told with both versions`, async () => {
    await serving(other(first), async (base, asked) => {
      const client = new Client(base, QUICK);
      for (const ask of [() => client.models(), () => client.file("reach", "bvh", CLIP)]) {
        const found = await faultOf(Unexpected, ask());
        assert.deepEqual([found.service, found.client], ["9.1.0", CONTRACT]);
        assert.match(found.message, /speaks version 9\.1\.0 of the contract, this client /);
      }
      assert.ok(!asked.includes("/elsewhere"));
    });
  });
}

test("versions are not spoken of where they agree, or cannot be asked", async () => {
  for (const said of [`{"status":"live","contract":"${CONTRACT}"}`, "no JSON"]) {
    const handler: Handler = ({ url }, answer) => json(answer, url === "/livez" ? said : "[]");
    await serving(handler, async (base) => {
      const found = await faultOf(Unexpected, new Client(base, QUICK).models());
      assert.doesNotMatch(found.message, /this client/);
    });
  }
});

test("who asks may end the question, and the service sees it", async () => {
  let left = false;
  const ending = new AbortController();
  const wait: Handler = (request) => {
    request.on("close", () => (left = true));
    ending.abort(new Error("enough"));
  };
  await serving(wait, async (base) => {
    const asked = fault(new Client(base, { timeout: Infinity }).models(ending.signal));
    assert.equal(((await asked) as Error).message, "enough");
    while (!left) await new Promise((done) => setTimeout(done, 5));
  });
});

test("who asks may end the question while its answer comes", async () => {
  const begin: Handler = (_, answer) => file(answer).write("BVH");
  await serving(begin, async (base, asked) => {
    const signal = AbortSignal.timeout(500);
    const found = await fault(new Client(base, QUICK).file("reach", "bvh", CLIP, signal));
    assert.equal(found, signal.reason);
    assert.equal(asked.length, 1);
  });
});

test("how much will come is said where it is known", async () => {
  const content = Buffer.alloc(100_000, "x");
  for (const packed of [false, true]) {
    const sent = packed ? gzipSync(content) : content;
    const coding = packed ? { "Content-Encoding": "gzip" } : {};
    const kind = { "Content-Type": "model/vnd.usda; charset=utf-8" };
    const headers = { ...kind, ...coding, "Content-Length": sent.length };
    await serving(
      (_, answer) => answer.writeHead(200, headers).end(sent),
      async (base) => {
        const steps: Progress[] = [];
        const onProgress = (step: Progress) => steps.push(step);
        await new Client(base).crowdFile("walk", "usda", {}, { onProgress });
        assert.deepEqual(steps.at(-1), { received: 100_000, total: packed ? null : 100_000 });
      },
    );
  }
});

test("a question that is ended while it waits to be asked again is not asked again", async () => {
  const fail = (answer: ServerResponse) => refuse(answer, "late", 503, { "Retry-After": "20" });
  await serving(failing(9, fail), async (base, asked) => {
    const signal = AbortSignal.timeout(500);
    const found = await fault(new Client(base, QUICK).models(signal));
    assert.equal(found, signal.reason);
    assert.equal(asked.length, 1);
  });
});

test("a key goes with every question", async () => {
  await serving(failing(1, refuse503), async (base) => {
    const { client, sent } = observed(base, { ...QUICK, key: "secret" });
    await client.models();
    assert.deepEqual(
      sent.map(({ headers }) => headers.get("Authorization")),
      ["Bearer secret", "Bearer secret"],
    );
  });
});
