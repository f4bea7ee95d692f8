import { defineConfig } from 'vitest/config';

// The gateway that `npm run dev` sends calls to.
const gateway = 'http://127.0.0.1:8080';

export default defineConfig({
  base: './',
  build: {
    outDir: '../../../build/dashboard',
    emptyOutDir: true,
    target: 'es2022',
    // kB. It is one page, and most of it is the map library.
    chunkSizeWarningLimit: 800,
  },
  server: { proxy: { '/hypermap.v1.': gateway } },
  test: { environment: 'node', include: ['src/**/*.test.ts'] },
});
