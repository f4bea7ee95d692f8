import {
  type BrowserContext,
  type Page,
  type PageScreenshotOptions,
  test as base,
} from '@playwright/test';
import { mkdir, rm, writeFile } from 'node:fs/promises';

import { Dashboard } from './dashboard.js';
import { buildFolder } from './places.js';
import { drawExploredOffice, drawMaps, drawOffice, Site } from './site.js';

export { expect } from '@playwright/test';

interface TestFixtures {
  /** The office on a server of this test's own. */
  site: Site;
  /** The office half explored by three robots, with the layers found, explored and explorations. */
  exploredSite: Site;
  /** A server without maps. */
  emptySite: Site;
  /** The dashboard in the test's page, not opened yet. */
  dashboard: Dashboard;
  /** The dashboard in another browser, which shares nothing with the first. */
  otherDashboard: Dashboard;
  /** Console errors that the test causes on purpose. */
  expectedErrors: RegExp[];
}

interface WorkerFixtures {
  officeMaps: string;
  exploredMaps: string;
  noMaps: string;
}

type Use<T> = (value: T) => Promise<void>;

async function useMaps(maps: Promise<string>, use: Use<string>): Promise<void> {
  const folder = await maps;
  await use(folder);
  await rm(folder, { recursive: true, force: true });
}

async function useSite(maps: string, use: Use<Site>): Promise<void> {
  const site = await Site.open(maps);
  try {
    await use(site);
  } finally {
    await site.close();
  }
}

/** Collects the console errors and exceptions of a page, each with its source. */
function collectErrors(page: Page, errors: string[]): void {
  page.on('console', (message) => {
    if (message.type() === 'error') errors.push(`${message.text()} (${message.location().url})`);
  });
  page.on('pageerror', (error) => errors.push(error.stack ?? String(error)));
}

const drawNothing = async (): Promise<void> => undefined;

// Creating the maps may take long on a busy machine and does not count towards a test's own
// timeout.
const worker = { scope: 'worker', timeout: 400_000 } as const;

/* eslint no-empty-pattern: off -- Playwright reads from its pattern what a fixture needs */
/** Calls `use`, then fails if a page of the context has logged an error that is not expected. */
async function checkConsole(
  context: BrowserContext,
  expected: RegExp[],
  use: () => Promise<void>,
): Promise<void> {
  const errors: string[] = [];
  context.on('page', (page) => collectErrors(page, errors));
  await use();
  const unexpected = errors.filter((text) => !expected.some((known) => known.test(text)));
  if (unexpected.length > 0) throw new Error(`errors on the console:\n${unexpected.join('\n')}`);
}

/** A test with its own server, which fails if one of its pages logs an unexpected error. */
export const test = base.extend<TestFixtures, WorkerFixtures>({
  officeMaps: [({}, use) => useMaps(drawMaps(drawOffice), use), worker],
  exploredMaps: [({}, use) => useMaps(drawMaps(drawExploredOffice), use), worker],
  noMaps: [({}, use) => useMaps(drawMaps(drawNothing), use), worker],
  site: ({ officeMaps }, use) => useSite(officeMaps, use),
  exploredSite: ({ exploredMaps }, use) => useSite(exploredMaps, use),
  emptySite: ({ noMaps }, use) => useSite(noMaps, use),
  dashboard: ({ page }, use) => use(new Dashboard(page)),
  expectedErrors: [[], { option: true }],
  context: ({ context, expectedErrors }, use) =>
    checkConsole(context, expectedErrors, () => use(context)),
  otherDashboard: async (
    { playwright, launchOptions, contextOptions, viewport, expectedErrors },
    use,
  ) => {
    const browser = await playwright.chromium.launch(launchOptions);
    try {
      const context = await browser.newContext({ ...contextOptions, viewport });
      const useIt = async () => use(new Dashboard(await context.newPage()));
      await checkConsole(context, expectedErrors, useIt);
    } finally {
      await browser.close();
    }
  },
});

const shotDeadlineMs = 10_000;
// Taking a screenshot keeps a processor busy, so that two in a row would slow down other tests.
const stillPauseMs = 200;

/** Takes a screenshot once two in a row are equal, or when the time is over. */
export async function stillScreenshot(
  page: Page,
  options: PageScreenshotOptions = {},
  timeoutMs = Infinity,
): Promise<Buffer> {
  const deadline = Date.now() + timeoutMs;
  let before: Buffer | undefined;
  let now = await page.screenshot(options);
  while (!before?.equals(now) && Date.now() < deadline) {
    await page.waitForTimeout(stillPauseMs);
    [before, now] = [now, await page.screenshot(options)];
  }
  return now;
}

/**
 * Takes a screenshot once nothing moves, or after some seconds, and saves it as
 * build/e2e/screenshots/NAME.png.
 */
export async function shot(page: Page, name: string): Promise<void> {
  const picture = await stillScreenshot(page, {}, shotDeadlineMs);
  const folder = `${buildFolder}/e2e/screenshots`;
  await mkdir(folder, { recursive: true });
  await writeFile(`${folder}/${name}.png`, picture);
}
