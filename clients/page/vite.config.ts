import { defineConfig } from "vite";

// Files that `posefield page` copies beside models; relative, so that they work in any folder.
export default defineConfig({
  base: "./",
  build: {
    outDir: "../../service/posefield/http/pages/model",
    emptyOutDir: true,
    chunkSizeWarningLimit: 2000,
  },
});
