import { copyFileSync, readFileSync, writeFileSync } from "node:fs";
import { fileURLToPath } from "node:url";
import { gzipSync } from "node:zlib";
import { defineConfig, type Plugin } from "vite";

const RUNTIME = "ort-wasm-simd-threaded";

/** onnxruntime-web's own files as they are; the large one pressed, which `posefield page` unpacks. */
function runtime(): Plugin {
  const found = (name: string) => fileURLToPath(import.meta.resolve(`onnxruntime-web/${name}`));
  return {
    name: "posefield-runtime",
    writeBundle({ dir }) {
      copyFileSync(found(`${RUNTIME}.mjs`), `${dir}/${RUNTIME}.mjs`);
      const pressed = gzipSync(readFileSync(found(`${RUNTIME}.wasm`)), { level: 9 });
      writeFileSync(`${dir}/${RUNTIME}.wasm.gz`, pressed);
    },
  };
}

// What a page without a service loads, beside it: see service/posefield/cli/command_page.py.
export default defineConfig({
  plugins: [runtime()],
  resolve: { conditions: ["onnxruntime-web-use-extern-wasm", "import", "module", "browser"] },
  build: {
    outDir: "../../service/posefield/http/pages/offline",
    emptyOutDir: true,
    modulePreload: false,
    lib: { entry: "src/offline/entry.ts", formats: ["es"], fileName: () => "offline.js" },
  },
});
