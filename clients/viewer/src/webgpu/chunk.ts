/** What the page loads of WebGPU, when a browser has it: one script beside the page. */

export { Drawing } from "./crowd.ts";
export { Kernel } from "./kernel.ts";
