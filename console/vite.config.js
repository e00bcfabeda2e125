import { defineConfig } from "vite";

// Fixed names: console/embed.cmake compiles these three files into the program.
export default defineConfig({
  base: "./",
  esbuild: { legalComments: "inline" },
  build: {
    target: "es2022",
    modulePreload: { polyfill: false },
    assetsInlineLimit: 0,
    rollupOptions: {
      output: {
        entryFileNames: "app.js",
        assetFileNames: "app.[ext]",
        // "!": the minifier keeps it, as uPlot's licence asks.
        banner: "/*! uPlot: Copyright (c) 2025, Leon Sorokin. MIT licence. photocoag: Apache-2.0. */",
      },
    },
  },
});
