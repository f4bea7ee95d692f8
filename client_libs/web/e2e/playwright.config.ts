import { defineConfig } from '@playwright/test';

import { buildFolder, chromium } from './support/places.js';

// ctest runs groups of spec files in parallel, each with its own folder for the results.
const run = process.env.E2E_RUN ?? 'all';

export default defineConfig({
  testDir: 'specs',
  outputDir: `${buildFolder}/e2e/results/${run}`,
  reporter: 'list',
  workers: Number(process.env.E2E_WORKERS ?? 2),
  forbidOnly: true,
  // A browser that fails once does not fail CI, but the report calls the test flaky.
  retries: process.env.CI ? 1 : 0,
  timeout: 400_000,
  expect: { timeout: 60_000 },
  use: {
    viewport: { width: 1440, height: 900 },
    colorScheme: 'light',
    actionTimeout: 60_000,
    // Recording a trace takes time. To see why a test fails, run it with --trace on.
    trace: 'on-first-retry',
    launchOptions: {
      executablePath: chromium,
      args: [
        '--no-sandbox',
        '--disable-gpu',
        // Containers often have only 64 MB there; a screenshot of the wall takes 33 MB.
        '--disable-dev-shm-usage',
        '--disable-quic',
        '--no-first-run',
        '--disable-background-networking',
        '--disable-component-update',
        '--disable-sync',
      ],
    },
  },
});
