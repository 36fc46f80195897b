import { readFile } from "node:fs/promises";
import { defineConfig } from "vite";

// The script beside the page, which the page loads where a browser has WebGPU.
export default defineConfig({
  plugins: [
    {
      name: "wgsl",
      /** A shader without comments and indentation, as a string. */
      async load(path: string) {
        if (!path.endsWith(".wgsl")) return null;
        const text = await readFile(path, "utf8");
        const short = text.replace(/^\s*\/\/.*\n/gm, "").replace(/^\s+/gm, "");
        return `export default ${JSON.stringify(short)}`;
      },
    },
  ],
  build: {
    outDir: "../../service/posefield/http/pages/viewer",
    emptyOutDir: false,
    lib: { entry: "src/webgpu/chunk.ts", formats: ["es"], fileName: () => "crowd-webgpu.js" },
  },
});
