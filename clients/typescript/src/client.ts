/** Questions over HTTP. */

import { decode } from "@msgpack/msgpack";

import { Problem, Unexpected, Unreachable } from "./errors.ts";
import { crowd, motion, type Packed, poses } from "./numbers.ts";
import type {
  ClipFormat,
  ClipQuestion,
  CrowdPoses,
  CrowdQuestion,
  ModelCard,
  ModelSummary,
  Motion,
  PoseQuestion,
  Poses,
  Reasons,
  SigmaGrid,
  SigmaQuestion,
  WhyQuestion,
} from "./types.ts";

export interface ClientOptions {
  /** API key or token, sent as `Authorization: Bearer`. */
  readonly key?: string;
}

/** A file as the service names it. */
export interface Download {
  readonly name: string;
  readonly mediaType: string;
  readonly content: Uint8Array<ArrayBuffer>;
}

export class Client {
  readonly base: string;
  readonly #headers: Record<string, string>;

  constructor(base = "", options: ClientOptions = {}) {
    this.base = base.replace(/\/+$/, "");
    this.#headers = options.key ? { Authorization: `Bearer ${options.key}` } : {};
  }

  async models(signal?: AbortSignal): Promise<readonly ModelSummary[]> {
    const { models } = (await this.#json("/v1/models", signal)) as { models: ModelSummary[] };
    return models;
  }

  async card(model: string, signal?: AbortSignal): Promise<ModelCard> {
    return (await this.#json(`/v1/models/${model}`, signal)) as ModelCard;
  }

  async pose(model: string, question: PoseQuestion, signal?: AbortSignal): Promise<Poses> {
    return poses(await this.#packed(`/v1/models/${model}/pose.msgpack`, question, signal));
  }

  async clip(model: string, question: ClipQuestion, signal?: AbortSignal): Promise<Motion> {
    return motion(await this.#packed(`/v1/models/${model}/clip.msgpack`, question, signal));
  }

  async crowd(model: string, question: CrowdQuestion, signal?: AbortSignal): Promise<CrowdPoses> {
    return crowd(await this.#packed(`/v1/models/${model}/crowd.msgpack`, question, signal));
  }

  async sigma(model: string, question: SigmaQuestion, signal?: AbortSignal): Promise<SigmaGrid> {
    const answer = await this.#ask(`/v1/models/${model}/sigma.json`, question, signal);
    return (await answer.json()) as SigmaGrid;
  }

  async why(model: string, question: WhyQuestion, signal?: AbortSignal): Promise<Reasons> {
    const answer = await this.#ask(`/v1/models/${model}/why`, question, signal);
    return (await answer.json()) as Reasons;
  }

  async file(
    model: string,
    format: ClipFormat,
    question: ClipQuestion,
    signal?: AbortSignal,
  ): Promise<Download> {
    const answer = await this.#ask(`/v1/models/${model}/clip.${format}`, question, signal);
    const mediaType = answer.headers.get("Content-Type") ?? "";
    return {
      name: `${model}.${format}`,
      mediaType,
      content: new Uint8Array(await answer.arrayBuffer()),
    };
  }

  async #json(path: string, signal?: AbortSignal): Promise<unknown> {
    return (await this.#fetch(path, { method: "GET" }, signal)).json();
  }

  async #packed(path: string, question: object, signal?: AbortSignal): Promise<Packed> {
    const answer = await this.#ask(path, question, signal);
    return decode(new Uint8Array(await answer.arrayBuffer())) as Packed;
  }

  async #ask(path: string, question: object, signal?: AbortSignal): Promise<Response> {
    return this.#fetch(path, { method: "POST", body: JSON.stringify(question) }, signal);
  }

  async #fetch(path: string, init: RequestInit, signal?: AbortSignal): Promise<Response> {
    const headers = {
      ...this.#headers,
      ...(init.body ? { "Content-Type": "application/json" } : {}),
    };
    let answer: Response;
    try {
      answer = await fetch(this.base + path, { ...init, headers, ...(signal ? { signal } : {}) });
    } catch (fault) {
      if (signal?.aborted) throw fault;
      throw new Unreachable(`${this.base || "the service"} does not answer`, { cause: fault });
    }
    if (!answer.ok) throw await problem(answer);
    return answer;
  }
}

async function problem(answer: Response): Promise<Error> {
  if (!answer.headers.get("Content-Type")?.startsWith("application/problem+json")) {
    return new Unexpected(`status ${answer.status} without a problem's description`);
  }
  const { type, title, detail } = (await answer.json()) as {
    type: string;
    title: string;
    detail?: string;
  };
  return new Problem(answer.status, type.split(/[/#]/).at(-1) ?? "", title, detail ?? "");
}
