import { defineConfig } from "vite";

// Fixed names: console/embed.cmake compiles these three files into the program.
export default defineConfig({
  base: "./",
  build: {
    target: "es2022",
    modulePreload: { polyfill: false },
    assetsInlineLimit: 0,
    rollupOptions: {
      output: {
        entryFileNames: "app.js",
        assetFileNames: "app.[ext]",
        // The minifier drops it, its licence asks for it.
        postBanner: "/* uPlot: Copyright (c) 2025, Leon Sorokin. MIT licence. photocoag: Apache-2.0. */",
      },
    },
  },
});
