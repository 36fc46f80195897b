/** The real service that tests ask, servers that fail in their own ways, and what was sent to them. */

import { createServer, type IncomingMessage, type ServerResponse } from "node:http";
import type { AddressInfo } from "node:net";

import { Client, type ClientOptions } from "../src/index.ts";

/** Address of a service with the models of api/examples; tests/clients/typescript starts it. */
export const URL_OF_SERVICE = process.env["POSEFIELD_URL"] ?? "";

export interface Sent {
  readonly method: string;
  readonly path: string;
  readonly headers: Headers;
  readonly body: unknown;
  readonly status: number;
}

export interface Observed {
  readonly client: Client;
  /** Requests and answers so far. */
  readonly sent: Sent[];
}

export function needed(name: string): string {
  const found = process.env[name];
  if (found === undefined) throw new Error(`${name} is not set: see tests/clients/typescript`);
  return found;
}

/** A client of which one sees what it asks; what it asks reaches whom it asks. */
export function observed(base: string = URL_OF_SERVICE, options: ClientOptions = {}): Observed {
  const sent: Sent[] = [];
  const seen: typeof fetch = async (input, init) => {
    const answer = await fetch(input, init);
    sent.push({
      method: init?.method ?? "GET",
      path: String(input).slice(base.length),
      headers: new Headers(init?.headers),
      body: typeof init?.body === "string" ? JSON.parse(init.body) : null,
      status: answer.status,
    });
    return answer;
  };
  return { client: new Client(base, { ...options, fetch: seen }), sent };
}

export type Handler = (request: IncomingMessage, answer: ServerResponse, count: number) => void;

/** Runs a test with a server of its own; the handler is told how many requests came before. */
export async function serving(
  handler: Handler,
  test: (base: string, asked: string[]) => Promise<void>,
): Promise<void> {
  const asked: string[] = [];
  const server = createServer((request, answer) => {
    asked.push(request.url ?? "");
    handler(request, answer, asked.length - 1);
  });
  await new Promise<void>((done) => server.listen(0, "127.0.0.1", done));
  const { port } = server.address() as AddressInfo;
  try {
    await test(`http://127.0.0.1:${port}`, asked);
  } finally {
    server.closeAllConnections();
    await new Promise((done) => server.close(done));
  }
}

/** Controls in the middle of what was sampled. */
export async function defaults(client: Client, model = "reach"): Promise<Record<string, number>> {
  const { controls } = await client.card(model);
  return Object.fromEntries(controls.map((control) => [control.name, control.default]));
}
