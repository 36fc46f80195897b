import { readFileSync, writeFileSync } from "node:fs";
import { fileURLToPath } from "node:url";
import { defineConfig, type Plugin } from "vite";
import { viteSingleFile } from "vite-plugin-singlefile";

const TEXTS = ["NOTICE", "LICENSE", "swagger-ui-es-bundle.js.LICENSE.txt"];

/** The licences of Swagger UI and of the packages in its bundle, which have to go with it. */
function licences(): Plugin {
  const text = (name: string) =>
    readFileSync(fileURLToPath(import.meta.resolve(`swagger-ui-dist/${name}`)), "utf8");
  return {
    name: "posefield-licences",
    writeBundle({ dir }) {
      writeFileSync(`${dir}/LICENSES.txt`, TEXTS.map(text).join("\n\n"));
    },
  };
}

// One file, the service's answer to `/docs`: see service/posefield/http/pages/standalone.py.
export default defineConfig({
  plugins: [viteSingleFile({ removeViteModuleLoader: true }), licences()],
  build: {
    outDir: "../../service/posefield/http/pages/docs",
    emptyOutDir: true,
    modulePreload: false,
  },
  server: { proxy: { "/v1": "http://127.0.0.1:8000", "/openapi.json": "http://127.0.0.1:8000" } },
});
