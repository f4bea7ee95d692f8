import { type BrowserContext, type Page, test as base } from '@playwright/test';
import { mkdir, rm, writeFile } from 'node:fs/promises';

import { Dashboard } from './dashboard.js';
import { buildFolder } from './places.js';
import { drawExploredOffice, drawMaps, drawOffice, Site } from './site.js';

export { expect } from '@playwright/test';

interface TestFixtures {
  /** The office, served for this test alone. */
  site: Site;
  /** The office with three robots that have explored half of it: layers found, explored, explorations. */
  exploredSite: Site;
  /** A server that has no map. */
  emptySite: Site;
  /** The test's page, not opened yet. */
  dashboard: Dashboard;
  /** A page of another browser, which shares nothing with the first. */
  otherDashboard: Dashboard;
  /** Console errors that a test brings about on purpose. */
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

/** A page's complaints, told by their source. */
function collectErrors(page: Page, errors: string[]): void {
  page.on('console', (message) => {
    if (message.type() === 'error') errors.push(`${message.text()} (${message.location().url})`);
  });
  page.on('pageerror', (error) => errors.push(error.stack ?? String(error)));
}

const drawNothing = async (): Promise<void> => undefined;

// Drawing takes its time on a busy machine, and is none of the test's.
const worker = { scope: 'worker', timeout: 180_000 } as const;

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

/** Every test runs against its own server; any page of it that logs an error fails it. */
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

/** Keeps what the page shows, once nothing moves any more, as build/e2e/screenshots/NAME.png. */
export async function shot(page: Page, name: string): Promise<void> {
  let before: Buffer | undefined;
  let now = await page.screenshot();
  while (!before?.equals(now)) [before, now] = [now, await page.screenshot()];
  const folder = `${buildFolder}/e2e/screenshots`;
  await mkdir(folder, { recursive: true });
  await writeFile(`${folder}/${name}.png`, now);
}
