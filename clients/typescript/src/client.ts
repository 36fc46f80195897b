/** Questions to a service, as promises. */

import { checked, json, read } from "./documents.ts";
import { Unexpected, WrongQuestion } from "./errors.ts";
import { named } from "./named.ts";
import { crowd, motion, performance, poses } from "./numbers.ts";
import { asFile, get, link, post, type Request, request, under } from "./questions.ts";
import { type Script, scriptQuestion } from "./scripts.ts";
import type {
  ArchiveOptions,
  CharacterList,
  ClipEnding,
  ClipFormat,
  ClipQuestion,
  CrowdFormat,
  CrowdPoses,
  CrowdQuestion,
  Download,
  ModelCard,
  ModelSummary,
  Motion,
  NamedClipQuestion,
  NamedScript,
  PerformanceArchiveOptions,
  PerformanceFileOptions,
  PerformanceMotion,
  PerformanceQuestion,
  PerformanceReport,
  PoseQuestion,
  Poses,
  Readiness,
  Reasons,
  SigmaGrid,
  SigmaQuestion,
  Suggestions,
  TransferOptions,
  WalkQuestion,
  WhyQuestion,
} from "./types.ts";
import { type Whole, Wire } from "./wire.ts";

export interface ClientOptions {
  /** API key or token, sent as `Authorization: Bearer`. */
  readonly key?: string;
  /** Milliseconds without a byte after which a question ends with TimedOut; 30,000. */
  readonly timeout?: number;
  /** Number of attempts after the first one, where a fault may pass; 3. */
  readonly retries?: number;
  /** Milliseconds before the second attempt, doubled for each one after it; 200. */
  readonly pause?: number;
  /** Characters up to which a question is a link (GET), beyond them a body (POST); 2,000. */
  readonly longestLink?: number;
  /** In place of the platform's own, such as one with a cache. */
  readonly fetch?: typeof fetch;
}

type Content = Uint8Array<ArrayBuffer>;

export class Client {
  readonly base: string;
  readonly #longest: number;
  readonly #wire: Wire;

  /**
   * base: scheme, host and port of the service; empty for where the page comes from. WrongQuestion
   * where that is no address, or the key none that a header can hold.
   */
  constructor(base = "", options: ClientOptions = {}) {
    this.base = addressOf(base).replace(/\/+$/, "");
    this.#longest = options.longestLink ?? 2000;
    this.#wire = new Wire({
      base: this.base,
      headers: options.key ? { Authorization: `Bearer ${printable(options.key)}` } : {},
      timeout: options.timeout ?? 30_000,
      retries: options.retries ?? 3,
      pause: options.pause ?? 200,
      // A browser's own refuses to be called as a method.
      fetch: options.fetch ?? ((...words) => fetch(...words)),
    });
  }

  async models(signal?: AbortSignal): Promise<readonly ModelSummary[]> {
    return this.#read(get("/v1/models"), (found) => read("ModelList", found).models, signal);
  }

  /** Characters of users, to which motions are delivered, and files that cannot be used. */
  async characters(signal?: AbortSignal): Promise<CharacterList> {
    return this.#read(get("/v1/characters"), (found) => read("CharacterList", found), signal);
  }

  async card(model: string, signal?: AbortSignal): Promise<ModelCard> {
    return this.#read(get(under(model, "")), (found) => read("ModelCard", found), signal);
  }

  /** The character at rest as binary glTF: its joints and the body of all files. */
  async character(model: string, signal?: AbortSignal): Promise<Download> {
    const asked = asFile(get(under(model, "/character.glb")), "glb");
    return this.#file(asked, `${model}.glb`, { signal });
  }

  async pose(model: string, question: PoseQuestion, signal?: AbortSignal): Promise<Poses> {
    const asked = this.#request(model, "/pose.msgpack", question);
    return this.#read(asked, poses, signal);
  }

  /** A clip as numbers. */
  async clip(model: string, question: ClipQuestion, signal?: AbortSignal): Promise<Motion> {
    const asked = this.#request(model, "/clip.msgpack", question);
    return this.#read(asked, motion, signal);
  }

  /** One pose of each of many characters. */
  async crowd(model: string, question: CrowdQuestion, signal?: AbortSignal): Promise<CrowdPoses> {
    return this.#read(post(under(model, "/crowd.msgpack"), question), crowd, signal);
  }

  /** Sigma over two controls. */
  async sigma(model: string, question: SigmaQuestion, signal?: AbortSignal): Promise<SigmaGrid> {
    const asked = this.#request(model, "/sigma.json", question);
    return this.#read(asked, (found) => read("SigmaGrid", found), signal);
  }

  /** The captured clips that an answer is made of. */
  async why(model: string, question: WhyQuestion, signal?: AbortSignal): Promise<Reasons> {
    const asked = this.#request(model, "/why", question);
    return this.#read(asked, (found) => read("Reasons", found), signal);
  }

  /** Clips to capture next, and their performers. */
  async suggestions(
    model: string,
    asked: Pick<WhyQuestion, "labels"> & {
      readonly count?: number;
      readonly performer?: string;
    } = {},
    signal?: AbortSignal,
  ): Promise<Suggestions> {
    const wanted = this.#request(model, "/suggestions", asked);
    return this.#read(wanted, (found) => read("Suggestions", found), signal);
  }

  /** A clip as a file. */
  async file(
    model: string,
    format: ClipEnding,
    question: ClipQuestion,
    signal?: AbortSignal,
  ): Promise<Download> {
    const asked = this.#request(model, `/clip.${format}`, question);
    return this.#file(asFile(asked, format), `${model}.${format}`, { signal });
  }

  /** Characters that walk, as a file. */
  async crowdFile(
    model: string,
    format: CrowdFormat,
    question: WalkQuestion,
    options: TransferOptions = {},
  ): Promise<Download> {
    const asked = asFile(get(link(under(model, `/crowd.${format}`), question)), format);
    return this.#file(asked, `${model}.${format}`, options);
  }

  /** One motion through the segments of a script, as numbers. */
  async performance(
    script: Script | PerformanceQuestion,
    signal?: AbortSignal,
  ): Promise<PerformanceMotion> {
    const asked = post("/v1/performances.msgpack", scriptQuestion(script));
    return this.#read(asked, performance, signal);
  }

  /** The same as a file. */
  async performanceFile(
    format: ClipFormat,
    script: Script | PerformanceQuestion,
    { layout, character, ...options }: PerformanceFileOptions = {},
  ): Promise<Download> {
    const path = link(`/v1/performances.${format}`, { layout, character });
    const asked = asFile(post(path, scriptQuestion(script)), format);
    return this.#file(asked, `performance.${format}`, options);
  }

  /** Many performances in one file, the last of which is a manifest of the others. */
  async performanceArchive(
    format: ClipFormat,
    scripts: readonly (Script | NamedScript)[],
    { as = "zip", layout, character, ...options }: PerformanceArchiveOptions = {},
  ): Promise<Download> {
    const question = { format, layout, character, scripts: scripts.map(scriptQuestion) };
    const asked = asFile(post(`/v1/performances/batch.${as}`, question), as);
    return this.#file(asked, `performances.${as}`, options);
  }

  /** Timeline, joins and warnings of a performance, without its poses. */
  async plan(
    script: Script | PerformanceQuestion,
    signal?: AbortSignal,
  ): Promise<PerformanceReport> {
    const asked = post("/v1/performances?plan=true", scriptQuestion(script));
    return this.#read(asked, (found) => checked("PerformanceReport", trustOf(found)), signal);
  }

  /** Many clips in one file, the last of which is a manifest of the others. */
  async archive(
    model: string,
    format: ClipFormat,
    clips: readonly NamedClipQuestion[],
    { as = "zip", ...options }: ArchiveOptions = {},
  ): Promise<Download> {
    const asked = asFile(post(under(model, `/clips.${as}`), { format, clips }), as);
    return this.#file(asked, `${model}.${as}`, options);
  }

  /** The link to the file of a clip or, without controls, of a crowd that walks. */
  url(model: string, format: ClipEnding, question: ClipQuestion | WalkQuestion): string {
    const kind = "controls" in question ? "clip" : "crowd";
    const path = link(under(model, `/${kind}.${format}`), question);
    return (this.base || (globalThis.location?.origin ?? "")) + path;
  }

  /** Loaded models; a Problem of kind not-ready, if the service is not ready. */
  async ready(signal?: AbortSignal): Promise<Readiness> {
    return this.#explained(async () => {
      const { content } = await this.#wire.once(get("/readyz"), { signal });
      return read("Readiness", content);
    });
  }

  /** Version of the contract that the service speaks. */
  async contract(signal?: AbortSignal): Promise<string> {
    const { content } = await this.#wire.once(get("/livez"), { signal });
    const live = json(content) as { readonly contract?: unknown } | null;
    if (typeof live?.contract === "string") return live.contract;
    throw new Unexpected("the service does not report the version of its contract");
  }

  #request(model: string, rest: string, question: object): Request {
    return request(under(model, rest), question, this.#longest);
  }

  async #file(asked: Request, fallback: string, options: TransferOptions): Promise<Download> {
    const look = ({ headers, content }: Whole) => ({ ...named(headers, fallback), content });
    return this.#explained(() => this.#wire.whole(asked, look, options));
  }

  async #read<Answer>(
    asked: Request,
    as: (content: Content) => Answer,
    signal: AbortSignal | undefined,
  ): Promise<Answer> {
    const look = ({ content }: Whole) => as(content);
    return this.#explained(() => this.#wire.whole(asked, look, { signal }));
  }

  /** An answer; what is unexpected in it is told with both versions, where they differ. */
  async #explained<Answer>(ask: () => Promise<Answer>): Promise<Answer> {
    try {
      return await ask();
    } catch (fault) {
      if (!(fault instanceof Unexpected)) throw fault;
      const service = await this.contract().catch(() => null);
      throw new Unexpected(fault.message, { cause: fault.cause, service });
    }
  }
}

function trustOf(content: Content): unknown {
  return (json(content) as { readonly trust?: unknown } | null)?.trust;
}

/** The address of a service; WrongQuestion for another text. */
function addressOf(base: string): string {
  if (base === "" || (/^https?:\/\/[^?#@\s]+$/i.test(base) && URL.canParse(base))) return base;
  throw new WrongQuestion("the address: expected http://host:port or https://host:port");
}

/** A key that a header can hold; the error does not contain it. */
function printable(key: string): string {
  if (/^[\x21-\x7e]+$/.test(key)) return key;
  throw new WrongQuestion("the key: expected printable ASCII without blanks");
}
