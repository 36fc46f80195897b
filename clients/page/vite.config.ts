import { defineConfig, type HtmlTagDescriptor, type Plugin } from "vite";

/** Tags that load WebAssembly and its module beside the page's code, not after it. */
const preload: Plugin = {
  name: "preload-onnxruntime",
  transformIndexHtml: {
    order: "post",
    handler(_, { bundle }) {
      const runtime = Object.keys(bundle ?? {}).filter((file) => /\bort\b/.test(file));
      return runtime.map((file): HtmlTagDescriptor => {
        const kind = file.endsWith(".wasm")
          ? { rel: "preload", as: "fetch" }
          : { rel: "modulepreload" };
        return { tag: "link", attrs: { ...kind, crossorigin: true, href: `./${file}` } };
      });
    },
  },
};

// Files that `posefield page` copies beside models; relative, so that they work in any folder.
export default defineConfig({
  base: "./",
  plugins: [preload],
  build: {
    outDir: "../../service/posefield/http/pages/model",
    emptyOutDir: true,
    chunkSizeWarningLimit: 2000,
  },
});
