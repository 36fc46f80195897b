/** Questions to a service, as promises. */

import { END, expectEnd, opened } from "./archives.ts";
import { json, read } from "./documents.ts";
import { Unexpected, WrongQuestion } from "./errors.ts";
import type { Whole } from "./memory.ts";
import { named } from "./named.ts";
import { crowd, motion, poses } from "./numbers.ts";
import { checkNames, checkQuestion, type QuestionKind } from "./option-names.ts";
import { asFile, get, link, post, type Request, request, under } from "./questions.ts";
import { streamed } from "./streams.ts";
import type {
  Archive,
  ArchiveFormat,
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
  PoseQuestion,
  Poses,
  Readiness,
  Reasons,
  SigmaGrid,
  SigmaQuestion,
  Suggestions,
  Transfer,
  TransferOptions,
  WalkQuestion,
  WhyQuestion,
} from "./types.ts";
import { Wire } from "./wire.ts";

export interface ClientOptions {
  /** API key or token, sent as `Authorization: Bearer`. */
  readonly key?: string;
  /** Milliseconds without a byte after which a question ends with TimedOut; 30,000. */
  readonly timeout?: number;
  /** How often to ask again where a fault may pass; 3. */
  readonly retries?: number;
  /** Milliseconds before asking again for the first time, each time after that twice as many; 200. */
  readonly pause?: number;
  /** Bytes of answers to keep, for where no browser does it; 0. */
  readonly cacheBytes?: number;
  /** Characters up to which a question is a link (GET), beyond them a body (POST); 2,000. */
  readonly longestLink?: number;
  /** Asks in place of the platform's own. */
  readonly fetch?: typeof fetch;
}

export interface ArchiveOptions extends TransferOptions {
  /** What the clips are sent in; zip. */
  readonly as?: ArchiveFormat;
}

type Content = Uint8Array<ArrayBuffer>;

/** Names of ClientOptions, TransferOptions and ArchiveOptions, which have no values at run time. */
const CLIENT_NAMES = {
  key: true,
  timeout: true,
  retries: true,
  pause: true,
  cacheBytes: true,
  longestLink: true,
  fetch: true,
} as const satisfies Record<keyof ClientOptions, true>;
const TRANSFER_NAMES = { signal: true, onProgress: true } as const satisfies Record<
  keyof TransferOptions,
  true
>;
const ARCHIVE_NAMES = { ...TRANSFER_NAMES, as: true } as const satisfies Record<
  keyof ArchiveOptions,
  true
>;

export class Client {
  readonly base: string;
  readonly #longest: number;
  readonly #wire: Wire;

  /**
   * base: scheme, host and port of the service; empty for where the page comes from. WrongQuestion
   * where that is no address, or the key none that a header can hold.
   */
  constructor(base = "", options: ClientOptions = {}) {
    checkNames("ClientOptions", Object.keys(CLIENT_NAMES), options);
    this.base = addressOf(base).replace(/\/+$/, "");
    this.#longest = options.longestLink ?? 2000;
    this.#wire = new Wire({
      base: this.base,
      headers: options.key ? { Authorization: `Bearer ${printable(options.key)}` } : {},
      timeout: options.timeout ?? 30_000,
      retries: options.retries ?? 3,
      pause: options.pause ?? 200,
      cacheBytes: options.cacheBytes ?? 0,
      // Called as a method of anything else, a browser's own refuses.
      fetch: options.fetch ?? ((...words) => fetch(...words)),
    });
  }

  async models(signal?: AbortSignal): Promise<readonly ModelSummary[]> {
    return this.#read(get("/v1/models"), (found) => read("ModelList", found).models, signal);
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
    const asked = this.#request(model, "/pose.msgpack", "PoseQuestion", question);
    return this.#read(asked, poses, signal);
  }

  /** A clip as numbers. */
  async clip(model: string, question: ClipQuestion, signal?: AbortSignal): Promise<Motion> {
    const asked = this.#request(model, "/clip.msgpack", "ClipQuestion", question);
    return this.#read(asked, motion, signal);
  }

  /** One pose of each of many characters. */
  async crowd(model: string, question: CrowdQuestion, signal?: AbortSignal): Promise<CrowdPoses> {
    checkQuestion("CrowdQuestion", question);
    return this.#read(post(under(model, "/crowd.msgpack"), question), crowd, signal);
  }

  /** Sigma over two controls. */
  async sigma(model: string, question: SigmaQuestion, signal?: AbortSignal): Promise<SigmaGrid> {
    const asked = this.#request(model, "/sigma.json", "SigmaQuestion", question);
    return this.#read(asked, (found) => read("SigmaGrid", found), signal);
  }

  /** Which captured clips an answer is made of. */
  async why(model: string, question: WhyQuestion, signal?: AbortSignal): Promise<Reasons> {
    const asked = this.#request(model, "/why", "WhyQuestion", question);
    return this.#read(asked, (found) => read("Reasons", found), signal);
  }

  /** Which clips to capture next, and of whom. */
  async suggestions(
    model: string,
    asked: Pick<WhyQuestion, "labels"> & {
      readonly count?: number;
      readonly performer?: string;
    } = {},
    signal?: AbortSignal,
  ): Promise<Suggestions> {
    const wanted = this.#request(model, "/suggestions", "SuggestQuestion", asked);
    return this.#read(wanted, (found) => read("Suggestions", found), signal);
  }

  /** A clip as a file. */
  async file(
    model: string,
    format: ClipFormat,
    question: ClipQuestion,
    signal?: AbortSignal,
  ): Promise<Download> {
    const asked = this.#request(model, `/clip.${format}`, "ClipQuestion", question);
    return this.#file(asFile(asked, format), `${model}.${format}`, { signal });
  }

  /** Characters that walk, as a file. */
  async crowdFile(
    model: string,
    format: CrowdFormat,
    question: WalkQuestion,
    options: TransferOptions = {},
  ): Promise<Download> {
    checkQuestion("WalkQuestion", question);
    checkNames("TransferOptions", Object.keys(TRANSFER_NAMES), options);
    const asked = asFile(get(link(under(model, `/crowd.${format}`), question)), format);
    return this.#file(asked, `${model}.${format}`, options);
  }

  /** Many clips in one file, looked through: all are there, and as long as they should be. */
  async archive(
    model: string,
    format: ClipFormat,
    clips: readonly NamedClipQuestion[],
    { as = "zip", ...options }: ArchiveOptions = {},
  ): Promise<Archive> {
    checkArchive(clips, options);
    const asked = asFile(post(under(model, `/clips.${as}`), { format, clips }), as);
    const download = await this.#file(asked, `${model}.${as}`, options);
    return this.#explained(async () => opened(download, as, clips.length));
  }

  /** The same while it comes, for what is too large to be held. */
  async stream(
    model: string,
    format: ClipFormat,
    clips: readonly NamedClipQuestion[],
    { as = "zip", ...options }: ArchiveOptions = {},
  ): Promise<Transfer> {
    checkArchive(clips, options);
    const { signal, onProgress } = options;
    const asked = asFile(post(under(model, `/clips.${as}`), { format, clips }), as);
    return this.#explained(async () => {
      const begun = await this.#wire.begin(asked, signal);
      try {
        const head = named(begun.answer.headers, `${model}.${as}`);
        return {
          ...head,
          body: streamed(begun, END, (...end) => expectEnd(as, ...end), onProgress),
        };
      } catch (fault) {
        begun.patience.leave();
        throw fault;
      }
    });
  }

  /** The link to a clip's file, to be sent on. */
  url(model: string, format: ClipFormat, question: ClipQuestion): string {
    checkQuestion("ClipQuestion", question);
    const path = link(under(model, `/clip.${format}`), question);
    return (this.base || (globalThis.location?.origin ?? "")) + path;
  }

  /** What the service says before it is sent questions; a Problem of kind not-ready, if it is not. */
  async ready(signal?: AbortSignal): Promise<Readiness> {
    return this.#explained(async () => {
      const { content } = await this.#wire.once(get("/readyz"), signal);
      return read("Readiness", content);
    });
  }

  /** Version of the contract that the service speaks. */
  async contract(signal?: AbortSignal): Promise<string> {
    const { content } = await this.#wire.once(get("/livez"), signal);
    const live = json(content) as { readonly contract?: unknown } | null;
    if (typeof live?.contract === "string") return live.contract;
    const whole = await this.#wire.once(get("/openapi.json"), signal);
    const said = json(whole.content) as { readonly info?: { readonly version?: unknown } } | null;
    if (typeof said?.info?.version === "string") return said.info.version;
    throw new Unexpected("the service does not say which version of the contract it speaks");
  }

  #request(model: string, rest: string, kind: QuestionKind, question: object): Request {
    checkQuestion(kind, question);
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

function checkArchive(clips: readonly NamedClipQuestion[], options: TransferOptions): void {
  for (const clip of clips) checkQuestion("NamedClipQuestion", clip);
  checkNames("ArchiveOptions", Object.keys(ARCHIVE_NAMES), options);
}

function addressOf(base: string): string {
  if (base === "" || (/^https?:\/\/[^?#@\s]+$/i.test(base) && URL.canParse(base))) return base;
  throw new WrongQuestion("the address: expected http://host:port or https://host:port");
}

/** A key that a header can hold; the error does not say it. */
function printable(key: string): string {
  if (/^[\x21-\x7e]+$/.test(key)) return key;
  throw new WrongQuestion("the key: expected printable ASCII without blanks");
}
