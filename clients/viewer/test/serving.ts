/** A service of one's own, to be stopped and started: POSEFIELD_COMMAND, over POSEFIELD_MODELS. */

import { type ChildProcess, spawn } from "node:child_process";
import { cpSync, mkdtempSync, rmSync } from "node:fs";
import { createServer } from "node:net";
import { tmpdir } from "node:os";
import { join } from "node:path";

const ROOT = new URL("../../../", import.meta.url).pathname;
const COMMAND = process.env["POSEFIELD_COMMAND"] ?? join(ROOT, ".venv/bin/posefield");
const MODELS = process.env["POSEFIELD_MODELS"] ?? join(ROOT, "build/models");

export class Serving {
  readonly port: number;
  /** A copy of the models, free to be changed. */
  readonly models: string;
  readonly #environ: Readonly<Record<string, string>>;
  #child: ChildProcess | null = null;

  static async make(environ: Readonly<Record<string, string>> = {}): Promise<Serving> {
    const made = new Serving(await free(), environ);
    await made.start();
    return made;
  }

  private constructor(port: number, environ: Readonly<Record<string, string>>) {
    this.port = port;
    this.#environ = environ;
    this.models = mkdtempSync(join(tmpdir(), "models-"));
    for (const name of ["reaching", "cmu_walk"])
      cpSync(join(MODELS, `${name}.onnx`), join(this.models, `${name}.onnx`));
  }

  get address(): string {
    return `http://127.0.0.1:${this.port}`;
  }

  async start(): Promise<void> {
    const port = String(this.port);
    const own = { POSEFIELD_PORT: port, POSEFIELD_LOG: "off", POSEFIELD_RELOAD: "1" };
    const env = { ...process.env, ...own, ...this.#environ };
    this.#child = spawn(COMMAND, ["serve", this.models], { env, cwd: ROOT, stdio: "ignore" });
    for (let look = 0; look < 240; look++) {
      if (await this.#ready()) return;
      await new Promise((done) => setTimeout(done, 250));
    }
    throw new Error("the service does not start");
  }

  async stop(): Promise<void> {
    const child = this.#child!;
    const ended = new Promise((done) => child.once("exit", done));
    child.kill("SIGKILL");
    await ended;
  }

  async end(): Promise<void> {
    await this.stop();
    rmSync(this.models, { recursive: true });
  }

  async #ready(): Promise<boolean> {
    return fetch(`${this.address}/readyz`).then(
      ({ ok }) => ok,
      () => false,
    );
  }
}

/** A port without a listener. */
async function free(): Promise<number> {
  const server = createServer().listen(0, "127.0.0.1");
  await new Promise((done) => server.once("listening", done));
  const { port } = server.address() as { port: number };
  await new Promise((done) => server.close(done));
  return port;
}
