/** A browser and the page in it; POSEFIELD_URL says where a service runs, CHROMIUM what to start. */

import {
  type Browser,
  type BrowserContextOptions,
  chromium,
  type Page,
  type Request,
} from "playwright-core";

// As on a machine without a graphics card: the processor draws, and puts the page together by itself
// (through SwiftShader too that took 60 ms a frame).
const ARGUMENTS = [
  "--no-sandbox",
  "--no-first-run",
  "--disable-quic",
  "--disable-background-networking",
  "--disable-component-update",
  "--disable-sync",
  "--disable-gpu",
  "--enable-unsafe-swiftshader",
];

export const SERVICE = process.env["POSEFIELD_URL"] ?? "http://127.0.0.1:8000";

export function browser(): Promise<Browser> {
  return chromium.launch({
    executablePath: process.env["CHROMIUM"] ?? "/usr/bin/chromium",
    args: ARGUMENTS,
  });
}

/** Milliseconds for what has to come true: far more than it takes beside other work on two cores. */
const PATIENCE = 120_000;

export async function blank(from: Browser, options: BrowserContextOptions = {}): Promise<Page> {
  const page = await from.newPage(options);
  page.setDefaultTimeout(PATIENCE);
  return page;
}

/** The page at that address (`/` and a hash); `faults` gathers what goes wrong in it unnoticed, and
 * `heard` is told each request from the first on. */
export async function opened(
  from: Browser,
  path = "/",
  size = { width: 1280, height: 720 },
  heard: (request: Request) => void = () => {},
): Promise<{ page: Page; faults: string[] }> {
  const page = await blank(from, { viewport: size });
  const faults: string[] = [];
  page.on("pageerror", (fault) => faults.push(String(fault)));
  page.on("console", (line) => {
    if (line.type() === "error") faults.push(line.text());
  });
  page.on("request", heard);
  await page.goto(SERVICE + path);
  return { page, faults };
}
