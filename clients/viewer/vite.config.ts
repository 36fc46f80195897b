import { defineConfig } from "vite";
import { viteSingleFile } from "vite-plugin-singlefile";

// One file, which the service answers `/` with: see service/posefield/http/pages/standalone.py.
export default defineConfig({
  plugins: [viteSingleFile({ removeViteModuleLoader: true })],
  build: {
    outDir: "../../service/posefield/http/pages/viewer",
    emptyOutDir: true,
    modulePreload: false,
  },
  server: { proxy: { "/v1": "http://127.0.0.1:8000", "/livez": "http://127.0.0.1:8000" } },
});
