/** A proxy between a page and its service: passes all on, and may slow or cut clips. */

import { createServer, type Server, type ServerResponse } from "node:http";
import type { AddressInfo } from "node:net";

/** Ways to send a clip's body on. */
export type Sending = (to: ServerResponse, body: Buffer) => Promise<void>;

export class Between {
  readonly #server: Server;
  clips: Sending = whole;

  static async make(service: string): Promise<Between> {
    const made = new Between(service);
    await new Promise((done) => made.#server.listen(0, "127.0.0.1", () => done(null)));
    return made;
  }

  private constructor(service: string) {
    this.#server = createServer(async (request, response) => {
      const parts: Buffer[] = [];
      for await (const part of request) parts.push(part);
      const type = request.headers["content-type"];
      const answer = await fetch(service + request.url, {
        method: request.method ?? "GET",
        headers: type ? { "content-type": type } : {},
        ...(parts.length ? { body: Buffer.concat(parts) } : {}),
      });
      const body = Buffer.from(await answer.arrayBuffer());
      const said = answer.headers.get("content-type") ?? "text/plain";
      response.writeHead(answer.status, { "content-type": said, "content-length": body.length });
      await (request.url!.includes("/clip.msgpack")
        ? this.clips(response, body)
        : whole(response, body));
    });
  }

  get address(): string {
    return `http://127.0.0.1:${(this.#server.address() as AddressInfo).port}`;
  }

  async end(): Promise<void> {
    this.#server.closeAllConnections();
    await new Promise((done) => this.#server.close(done));
  }
}

async function whole(to: ServerResponse, body: Buffer): Promise<void> {
  to.end(body);
}

/** In so many pieces, with so many milliseconds before each. */
export function slowly(pieces: number, pause: number): Sending {
  return async (to, body) => {
    const size = Math.ceil(body.length / pieces);
    for (let at = 0; at < body.length; at += size) {
      await new Promise((done) => setTimeout(done, pause));
      to.write(body.subarray(at, at + size));
    }
    to.end();
  };
}

/** Half of it, and the connection is gone. */
export async function cut(to: ServerResponse, body: Buffer): Promise<void> {
  await new Promise((done) => to.write(body.subarray(0, body.length >> 1), done));
  to.destroy();
}
