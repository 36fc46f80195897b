/** Files as they travel: as they are, and as what was asked for. */

import assert from "node:assert/strict";
import { test } from "node:test";
import { gzipSync } from "node:zlib";

import { Broken, Client, Unexpected } from "../src/index.ts";
import { defaults, type Handler, observed, serving } from "./service.ts";

const CLIP = { controls: {} };

/** Sends a file, as a proxy would: compressed for whoever takes that, and cut in either case. */
const cut: Handler = (request, answer) => {
  const packs = request.headers["accept-encoding"]?.includes("gzip") ?? false;
  const content = Buffer.from("HIERARCHY ".repeat(10_000));
  const sent = packs ? gzipSync(content).subarray(0, 100) : content.subarray(0, 50_000);
  const headers = { "Content-Type": "application/x-bvh" };
  if (packs) {
    // Whole by its framing: what compressed it has failed, not the connection.
    answer.writeHead(200, { ...headers, "Content-Encoding": "gzip" }).end(sent);
  } else {
    answer.writeHead(200, { ...headers, "Content-Length": content.length });
    answer.write(sent, () => answer.destroy());
  }
};

test("a file that is cut while something compresses it is broken", async () => {
  await serving(cut, async (base) => {
    const client = new Client(base, { retries: 0 });
    await assert.rejects(client.file("reach", "bvh", CLIP), Broken);
    // What would happen otherwise.
    const believed = await fetch(base);
    assert.ok((await believed.arrayBuffer()).byteLength < 100_000);
  });
});

test("walkers have the labels that are asked for", async () => {
  const { client, sent } = observed();
  const labels = { performer: { ann: 0.75, ben: 0.25 } };
  await client.crowdFile("walk", "usda", { count: 2, seconds: 0.2, labels });
  const asked = new URL(sent[0]!.path, "http://any").searchParams;
  assert.equal(asked.get("label"), "performer=ann:0.75,ben:0.25");
  const wrong = { labels: { performer: "bob" } };
  await assert.rejects(client.crowdFile("walk", "usda", wrong), /'bob', expected one of ann, ben/);
});

test("walkers have the takes that are asked for", async () => {
  const { client, sent } = observed();
  const takes = { take: "index", variety: 0.5, detail: true } as const;
  await client.crowdFile("walk", "usda", { count: 2, seconds: 0.2, ...takes });
  const asked = new URL(sent[0]!.path, "http://any").searchParams;
  assert.deepEqual(
    ["take", "variety", "detail"].map((name) => asked.get(name)),
    ["index", "0.5", "true"],
  );
});

test("files are asked for as they are, documents and poses in any coding", async () => {
  const { client, sent } = observed();
  const controls = await defaults(client);
  await client.pose("reach", { controls, times: [0] });
  await client.file("reach", "bvh", { controls });
  await client.crowdFile("walk", "usda", { count: 2, seconds: 0.2 });
  await client.archive("reach", "bvh", [{ controls }]);
  await (await client.stream("reach", "bvh", [{ controls }])).body.cancel();
  assert.deepEqual(
    sent.map(({ headers }) => headers.get("Accept-Encoding")),
    [null, null, ...Array(4).fill("identity")],
  );
});

test("a file of another kind than the one asked for is none", async () => {
  for (const said of ["text/html; charset=utf-8", "application/x-bvhs", null]) {
    await serving(
      (_, answer) => answer.writeHead(200, said ? { "Content-Type": said } : {}).end("HIERARCHY"),
      async (base) => {
        await assert.rejects(new Client(base).file("reach", "bvh", CLIP), {
          name: "Unexpected",
          message: /media type: found .*, expected application\/x-bvh$/,
        });
      },
    );
  }
});

test("a wrong answer is not kept", async () => {
  const headers = { "Content-Type": "application/json", ETag: '"1"', "Cache-Control": "immutable" };
  const wrong: Handler = ({ url }, answer, count) => {
    if (url === "/livez") answer.destroy();
    else answer.writeHead(200, headers).end(count === 0 ? "<html>" : '{"models":[]}');
  };
  await serving(wrong, async (base, asked) => {
    const client = new Client(base, { cacheBytes: 1000, retries: 0 });
    await assert.rejects(client.models(), Unexpected);
    assert.deepEqual(await client.models(), []);
    const before = asked.length;
    assert.deepEqual(await client.models(), []);
    assert.equal(asked.length, before);
  });
});

test("what is not to be kept is not kept", async () => {
  for (const [control, kept] of [
    ["no-cache", true],
    ["no-store", false],
    ["private, no-store", false],
  ] as const) {
    const tags: (string | undefined)[] = [];
    const listed: Handler = ({ headers }, answer) => {
      tags.push(headers["if-none-match"]);
      answer.writeHead(200, { ETag: '"1"', "Cache-Control": control }).end('{"models":[]}');
    };
    await serving(listed, async (base) => {
      const client = new Client(base, { cacheBytes: 1000 });
      await client.models();
      await client.models();
      assert.deepEqual(tags, [undefined, kept ? '"1"' : undefined], control);
    });
  }
});
