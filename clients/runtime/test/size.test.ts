/** Size of the package's own code as it travels. */

import assert from "node:assert/strict";
import { test } from "node:test";
import { fileURLToPath } from "node:url";
import { gzipSync } from "node:zlib";
import { build } from "vite";

const LIMIT = 18_000;

test("the code of the run time is small", async (context) => {
  const made = await build({
    logLevel: "error",
    configFile: false,
    build: {
      write: false,
      minify: true,
      lib: { entry: fileURLToPath(new URL("../src/index.ts", import.meta.url)), formats: ["es"] },
      rollupOptions: { external: [/^onnxruntime-web/], output: { minify: true } },
    },
  });
  const chunks = [made].flat().flatMap((bundle) => ("output" in bundle ? bundle.output : []));
  const code = chunks.map((chunk) => (chunk.type === "chunk" ? chunk.code : "")).join("");
  assert.match(code, /onnxruntime-web\/wasm/);
  const size = gzipSync(code).length;
  context.diagnostic(`${size} bytes`);
  assert.ok(size > 4000 && size < LIMIT, `${size} bytes`);
});
