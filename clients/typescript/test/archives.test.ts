/** Archives of many clips: whole ones of the real service, and the same in pieces. */

import assert from "node:assert/strict";
import type { ServerResponse } from "node:http";
import { before, test } from "node:test";
import { setTimeout as sleep } from "node:timers/promises";

import {
  type ArchiveFormat,
  Broken,
  Client,
  type NamedClipQuestion,
  type Progress,
  TimedOut,
  Unexpected,
} from "../src/index.ts";
import { members } from "../src/zip.ts";
import { defaults, type Handler, serving, URL_OF_SERVICE } from "./service.ts";

const client = new Client(URL_OF_SERVICE);
const FORMATS: readonly ArchiveFormat[] = ["zip", "tar"];
const whole: Record<ArchiveFormat, Uint8Array<ArrayBuffer>> = {
  zip: new Uint8Array(),
  tar: new Uint8Array(),
};
let clips: NamedClipQuestion[];

before(async () => {
  const controls = await defaults(client);
  // The longest name there may be, which no plain record of a tar holds.
  clips = [
    { controls, name: "low" },
    { controls, fps: 60 },
    { controls, name: "l".repeat(100) },
  ];
  for (const as of FORMATS) {
    whole[as] = (await client.archive("reach", "bvh", clips, { as })).content;
  }
});

for (const as of FORMATS) {
  test(`a ${as} has every clip, as the service gives each alone`, async () => {
    const steps: Progress[] = [];
    const onProgress = (progress: Progress) => steps.push(progress);
    const found = await client.archive("reach", "bvh", clips, { as, onProgress });
    assert.equal(found.name, `reach.${as}`);
    assert.equal(steps.at(-1)?.received, found.content.length);
    assert.equal(found.entries.length, found.files.size);
    for (const [index, entry] of found.entries.entries()) {
      const { name: _, ...question } = clips[index]!;
      const { content } = await client.file("reach", "bvh", question);
      assert.deepEqual(found.files.get(entry.file), content);
      assert.equal(await sha256(content), entry.sha256);
    }
  });

  test(`a ${as} that is cut anywhere is broken`, async () => {
    const { length } = whole[as];
    const cuts = [0, 1, 21, 22, 511, 512, 513, 1024, length >> 1, length - 1024, length - 1];
    for (const cut of cuts.filter((each) => each < length)) {
      const cutAt = whole[as].subarray(0, cut);
      await sent(cutAt, as, async (own) => {
        await assert.rejects(own.archive("reach", "bvh", clips, { as }), Broken, `at ${cut}`);
        const { body } = await own.stream("reach", "bvh", clips, { as });
        await assert.rejects(taken(body), Broken, `stream at ${cut}`);
      });
    }
  });

  test(`a ${as} with clips too few or too many is broken`, async () => {
    await sent(whole[as], as, async (own) => {
      assert.equal((await own.archive("reach", "bvh", clips, { as })).files.size, 3);
      const [first] = clips;
      await assert.rejects(own.archive("reach", "bvh", [first!], { as }), Broken);
      await assert.rejects(own.archive("reach", "bvh", [...clips, first!], { as }), Broken);
    });
  });

  test(`a ${as} whose manifest says otherwise is broken`, async () => {
    const text = Buffer.from(whole[as]).toString("latin1");
    const at = text.lastIndexOf('"bytes":') + '"bytes":'.length;
    for (const [place, digit] of [
      [at, "9"],
      [text.lastIndexOf("manifest.jsonl"), "M"],
    ] as const) {
      const other = whole[as].slice();
      other[place] = digit.charCodeAt(0);
      await sent(other, as, async (own) => {
        await assert.rejects(own.archive("reach", "bvh", clips, { as }), Broken, digit);
      });
    }
  });

  test(`a ${as} comes as a stream of the same bytes`, async () => {
    const found = await client.stream("reach", "bvh", clips, { as });
    assert.equal(found.name, `reach.${as}`);
    assert.match(found.model!, /^reach@/);
    assert.deepEqual(await taken(found.body), whole[as]);
  });
}

test("an archive with a file that its manifest does not name is broken", async () => {
  const size = Number.parseInt(Buffer.from(whole.tar.subarray(124, 136)).toString("latin1"), 8);
  const first = whole.tar.subarray(0, 512 + 512 * Math.ceil(size / 512));
  const other = first.slice();
  other[0] = "x".charCodeAt(0);
  // The first clip once more, and under another name.
  for (const more of [first, other]) {
    await sent(Buffer.concat([more, whole.tar]), "tar", async (own) => {
      const asked = own.archive("reach", "bvh", clips, { as: "tar" });
      await assert.rejects(asked, { name: "Broken", message: /holds 4 files, .* names 3/ });
    });
  }
});

test("a zip whose records are none is broken", () => {
  for (const signature of ["PK\x01\x02", "PK\x03\x04", "PK\x05\x06"]) {
    const other = whole.zip.slice();
    other[Buffer.from(other).indexOf(signature, 0, "latin1") + 3] = 9;
    assert.throws(() => [...members(other)], Broken);
  }
});

for (const as of FORMATS) {
  test(`a ${as} whose end comes in small pieces is whole`, async () => {
    const at = whole[as].length - 10;
    await serving(
      (_, answer) => {
        head(answer, as).write(whole[as].subarray(0, at));
        setTimeout(() => answer.end(whole[as].subarray(at)), 20);
      },
      async (base) => {
        const { body } = await new Client(base).stream("reach", "bvh", clips, { as });
        assert.deepEqual(await taken(body), whole[as]);
      },
    );
  });
}

test("a stream that is let go lets the service go", async () => {
  let left = false;
  await serving(
    (_, answer) => {
      answer.on("close", () => (left = true));
      head(answer, "zip").write("x".repeat(1000));
    },
    async (base) => {
      const { body } = await new Client(base, { timeout: Infinity }).stream("reach", "bvh", clips);
      const reader = body.getReader();
      await reader.read();
      // By now the stream waits for a piece that never comes.
      await sleep(50);
      await reader.cancel();
      while (!left) await sleep(5);
    },
  );
});

test("a stream whose head cannot be read lets the service go", async () => {
  let left = false;
  const nonsense: Handler = ({ url }, answer) => {
    if (url === "/livez") return answer.end();
    answer.on("close", () => (left = true));
    answer.setHeader("Posefield-Warning", "no JSON");
    return head(answer, "zip").write("x".repeat(1000));
  };
  await serving(nonsense, async (base) => {
    const own = new Client(base, { timeout: Infinity });
    await assert.rejects(own.stream("reach", "bvh", clips), Unexpected);
    while (!left) await sleep(5);
  });
});

test("a stream that is read slowly is not one that comes slowly", async () => {
  const piece = Buffer.alloc(1 << 20);
  const all = [piece, piece, piece, piece, Buffer.from(whole.tar)];
  const trickle: Handler = async (_, answer) => {
    head(answer, "tar");
    for (const each of all) await new Promise((done) => answer.write(each, done));
    answer.end();
  };
  await serving(trickle, async (base) => {
    const patient = new Client(base, { timeout: 500, retries: 0 });
    const { body } = await patient.stream("reach", "bvh", clips, { as: "tar" });
    await sleep(1000);
    const reader = body.getReader();
    await reader.read();
    await sleep(1000);
    let bytes = 0;
    for (;;) {
      const { done, value } = await reader.read();
      if (done) break;
      bytes += value.length;
    }
    assert.ok(bytes > 3 << 20);
  });
});

test("a stream that stops coming has its time", async () => {
  const begin: Handler = (_, answer) => head(answer, "zip").write("x".repeat(1000));
  await serving(begin, async (base) => {
    const { body } = await new Client(base, { timeout: 500 }).stream("reach", "bvh", clips);
    await assert.rejects(taken(body), TimedOut);
  });
});

test("a stream that its signal ends says the signal's reason", async () => {
  await serving(
    (_, answer) => {
      head(answer, "zip").write("x".repeat(1000));
    },
    async (base) => {
      const signal = AbortSignal.timeout(500);
      const ended = async () => {
        const { body } = await new Client(base).stream("reach", "bvh", clips, { signal });
        await taken(body);
      };
      await assert.rejects(ended, (fault: unknown) => fault === signal.reason);
    },
  );
});

test("a stream whose connection ends is broken, whatever has been handed on", async () => {
  await serving(
    (_, answer) => {
      head(answer, "zip").write("x".repeat(1000), () => answer.destroy());
    },
    async (base, asked) => {
      await assert.rejects(async () => {
        const { body } = await new Client(base).stream("reach", "bvh", clips);
        await taken(body);
      }, Broken);
      assert.equal(asked.length, 1);
    },
  );
});

test("a Zip64 says elsewhere how many files it has", () => {
  const directory = whole.zip.length - 6;
  const at = new DataView(whole.zip.buffer).getUint32(directory, true);
  const count = new DataView(whole.zip.buffer).getUint16(whole.zip.length - 12, true);
  const found = new Uint8Array(whole.zip.length + 76);
  const end = whole.zip.length - 22;
  found.set(whole.zip.subarray(0, end));
  found.set(whole.zip.subarray(end), end + 76);
  const view = new DataView(found.buffer);
  view.setUint32(end, 0x06064b50, true);
  view.setBigUint64(end + 32, BigInt(count), true);
  view.setBigUint64(end + 48, BigInt(at), true);
  view.setUint32(end + 56, 0x07064b50, true);
  view.setBigUint64(end + 64, BigInt(end), true);
  view.setUint16(found.length - 12, 0xffff, true);
  assert.deepEqual([...members(found)], [...members(whole.zip)]);
});

/** Runs a test with a service that answers everything with some bytes, framed as a whole answer. */
async function sent(
  content: Uint8Array,
  as: ArchiveFormat,
  run: (client: Client) => Promise<void>,
): Promise<void> {
  await serving(
    (_, answer) => head(answer, as).end(content),
    (base) => run(new Client(base, { retries: 0 })),
  );
}

function head(answer: ServerResponse, as: ArchiveFormat): ServerResponse {
  const kind = { zip: "application/zip", tar: "application/x-tar" }[as];
  return answer.writeHead(200, { "Content-Type": kind });
}

async function taken(body: ReadableStream<Uint8Array<ArrayBuffer>>): Promise<Uint8Array> {
  return new Uint8Array(await new Response(body).arrayBuffer());
}

async function sha256(content: Uint8Array<ArrayBuffer>): Promise<string> {
  return Buffer.from(await crypto.subtle.digest("SHA-256", content)).toString("hex");
}
