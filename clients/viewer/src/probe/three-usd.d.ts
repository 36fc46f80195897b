/** What @types/three leaves out of three.js's parsers of USD. */

declare module "three/addons/loaders/usd/USDAParser.js" {
  export class USDAParser {
    parseData(text: string): { specsByPath: import("./usd-layer.ts").Specs };
  }
}
declare module "three/addons/loaders/usd/USDCParser.js" {
  export class USDCParser {
    parseData(content: ArrayBuffer): { specsByPath: import("./usd-layer.ts").Specs };
  }
}
