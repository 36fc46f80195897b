/** The page as `posefield page` writes it: one file, which is opened without a server. */

import { execFileSync } from "node:child_process";
import { join } from "node:path";
import { pathToFileURL } from "node:url";

import type { Accuracy } from "../src/offline/read.ts";

export const MODELS = process.env["POSEFIELD_MODELS"] ?? "../../build/models";
export const COMMAND = process.env["POSEFIELD_COMMAND"] ?? "../../.venv/bin/posefield";

/** What the command says of the file, and the file's address. */
export interface Copy {
  readonly address: string;
  readonly answers: number;
  readonly errors: Accuracy;
}

/** Writes a copy with a model's answers, few of them for a test. */
export function copied(model: string, folder: string): Copy {
  const file = join(folder, `${model}.html`);
  const words = ["--answers", "2000", "--json", "--output", file];
  const said = execFileSync(COMMAND, ["page", join(MODELS, `${model}.onnx`), ...words]);
  return { ...(JSON.parse(said.toString()) as Copy), address: pathToFileURL(file).href };
}
