/** Questions that the client has no method for, sent as the client sends its own. */

import { Problem, Unexpected, Unreachable } from "@posefield/client";

type Document = ConstructorParameters<typeof Problem>[0];

/** Milliseconds after which an answer is not waited for any more: of ten minutes of motion. */
const PATIENCE = 60_000;

/** The answer of where the page comes from; faults are those of the client. */
export async function post(
  path: string,
  body: string,
  key: string | null,
  signal: AbortSignal,
): Promise<Response> {
  const headers = {
    "Content-Type": "application/json",
    ...(key !== null && { Authorization: `Bearer ${key}` }),
  };
  const both = AbortSignal.any([signal, AbortSignal.timeout(PATIENCE)]);
  const answer = await fetched(path, { method: "POST", headers, body, signal: both });
  if (!answer.ok) throw await refusal(answer);
  return answer;
}

async function fetched(path: string, init: RequestInit): Promise<Response> {
  try {
    return await fetch(path, init);
  } catch (fault) {
    if (fault instanceof DOMException) throw fault;
    throw new Unreachable("the service does not answer", { cause: fault });
  }
}

async function refusal(answer: Response): Promise<Error> {
  const said = (await answer.json().catch(() => null)) as Partial<Document> | null;
  if (typeof said?.type !== "string" || typeof said.title !== "string")
    return new Unexpected(`status ${answer.status} without a problem's description`);
  const whole = { status: answer.status, detail: "", instance: "", errors: [], ...said };
  return new Problem(whole as Document, null);
}
