/** The page as `posefield page` writes it, on a host of static files. */

import { execFileSync } from "node:child_process";
import { readFileSync } from "node:fs";
import { createServer, type Server } from "node:http";
import type { AddressInfo } from "node:net";
import { extname, join } from "node:path";

const KINDS: Readonly<Record<string, string>> = {
  ".html": "text/html; charset=utf-8",
  ".js": "text/javascript",
  ".mjs": "text/javascript",
  ".wasm": "application/wasm",
};

export const MODELS = process.env["POSEFIELD_MODELS"] ?? "../../build/models";
export const COMMAND = process.env["POSEFIELD_COMMAND"] ?? "../../.venv/bin/posefield";

/** Writes the folder of a model. */
export function written(model: string, folder: string): void {
  execFileSync(COMMAND, ["page", join(MODELS, `${model}.onnx`), "--output", folder]);
}

/** A host of a folder's files and of nothing else; `null` in `base` once it is closed. */
export async function host(folder: string): Promise<{ base: string; server: Server }> {
  const server = createServer((request, response) => {
    const path = new URL(request.url ?? "/", "http://host").pathname;
    const name = path === "/" ? "/index.html" : path;
    try {
      const content = readFileSync(join(folder, name));
      response.writeHead(200, {
        "Content-Type": KINDS[extname(name)] ?? "application/octet-stream",
      });
      response.end(content);
    } catch {
      response.writeHead(404).end();
    }
  });
  await new Promise<void>((ready) => server.listen(0, "127.0.0.1", ready));
  const { port } = server.address() as AddressInfo;
  return { base: `http://127.0.0.1:${port}`, server };
}
