import { defineConfig } from 'vitest/config';

// The gateway to which `npm run dev` forwards calls.
const gateway = 'http://127.0.0.1:8080';

export default defineConfig({
  base: './',
  build: {
    outDir: '../../../build/dashboard',
    emptyOutDir: true,
    target: 'es2022',
    // In kB. The page is a single chunk, most of which is the map library.
    chunkSizeWarningLimit: 800,
  },
  server: { proxy: { '/hypermap.v1.': gateway, '/session': gateway } },
  test: {
    environment: 'node',
    include: ['src/**/*.test.ts'],
    testTimeout: 120_000,
    hookTimeout: 120_000,
  },
});
