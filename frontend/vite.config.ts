import react from "@vitejs/plugin-react";
import { defineConfig } from "vitest/config";
import { bootTexts } from "./build/bootTexts.ts";

const BENCH = "http://127.0.0.1:8600";

export default defineConfig({
  plugins: [react(), bootTexts()],
  build: {
    target: "es2022",
    // The content security policy allows no data: address, so nothing may be inlined.
    assetsInlineLimit: 0,
    sourcemap: false,
  },
  server: {
    host: "127.0.0.1",
    proxy: {
      "/api": { target: BENCH, ws: true },
      "/viser": { target: BENCH, ws: true },
    },
  },
  test: { include: ["src/**/*.test.ts"], environment: "node" },
});
