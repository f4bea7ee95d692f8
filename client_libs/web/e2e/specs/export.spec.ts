import type { Page } from '@playwright/test';
import { readFile } from 'node:fs/promises';

import { expect, shot, test } from '../support/test.js';

/** Clicks Save and returns the downloaded file. */
async function save(page: Page): Promise<{ name: string; data: Buffer }> {
  const download = page.waitForEvent('download');
  await page.getByRole('button', { name: 'Save' }).click();
  const file = await download;
  return { name: file.suggestedFilename(), data: await readFile(await file.path()) };
}

test('the map is saved in each format', async ({ site, dashboard, page }) => {
  await dashboard.open(site);
  await dashboard.panel('Export');

  const copy = await save(page);
  expect(copy.name).toBe('office.gpkg');
  expect(copy.data.subarray(0, 15).toString()).toBe('SQLite format 3');
  await expect(page.getByText(/^Saved office\.gpkg/)).toBeVisible();

  await page.getByRole('radio', { name: 'Hypermap' }).check();
  const hmap = await save(page);
  expect(hmap.name).toMatch(/\.hmap$/);
  expect(hmap.data.subarray(0, 2).toString()).toBe('PK');
  await shot(page, 'export');

  await page.getByRole('radio', { name: 'GeoJSON' }).check();
  await page.getByRole('group', { name: 'Layers' }).getByLabel('dock').uncheck();
  const geojson = await save(page);
  const collection = JSON.parse(geojson.data.toString()) as { features: unknown[] };
  expect(collection.features.length).toBeGreaterThan(10);

  await page.getByRole('radio', { name: 'Nav2' }).check();
  const nav2 = await save(page);
  expect(nav2.name).toBe('office_nav2.zip');
  expect(nav2.data.toString('latin1')).toContain('.yaml');
});
