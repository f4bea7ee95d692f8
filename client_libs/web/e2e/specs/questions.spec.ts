import type { Locator, Page } from '@playwright/test';

import { putSquare } from '../support/edits.js';
import { expect, shot, test } from '../support/test.js';

// Places in the office of the demo.
const KITCHEN_CUP = [11.7, 2.62] as const;
const EMPTY_FLOOR = [6, 6] as const;
const KITCHEN = [
  [10.2, 0.3],
  [14.4, 0.3],
  [14.4, 5],
  [10.2, 5],
] as const;

const panel = (page: Page, title: string): Locator => page.getByRole('region', { name: title });

async function find(page: Page, value: string): Promise<void> {
  await page.getByLabel('What to find').fill(value);
  await page.getByRole('button', { name: 'Find', exact: true }).click();
}

const found = (page: Page, group = 'objects'): Locator =>
  panel(page, 'Answer').getByRole('region', { name: group }).getByRole('listitem');

test('a click queries all layers at a point', async ({ site, dashboard, page }) => {
  await dashboard.open(site, { view: [12.2, 2.9, 0.02] });
  await dashboard.click(KITCHEN_CUP);
  const here = panel(page, 'At this point');
  await expect(here.getByRole('heading')).toHaveText(/^At 11\.70, 2\.62/);
  for (const layer of ['dock', 'floor', 'objects', 'seen', 'wifi']) {
    await expect(here.getByRole('term').filter({ hasText: layer })).toBeVisible();
  }
  await expect(here.getByRole('definition').filter({ hasText: 'dBm' })).toBeVisible();
  await expect(here.getByRole('button', { name: 'cup' })).toHaveAttribute('aria-pressed', 'true');
  await expect(here.getByRole('button', { name: 'dining table' })).toBeVisible();
  await expect(page.getByRole('article', { name: 'Object cup' })).toBeVisible();

  await here.getByRole('button', { name: 'dining table' }).click();
  await expect(page.getByRole('article', { name: 'Object dining table' })).toBeVisible();
  await shot(page, 'point_query');

  await dashboard.click([6.9, -6]);
  await expect(here).toContainText('outside the layer');
  await expect(page.getByRole('article')).toHaveCount(0);
});

test('a point is queried at the shown revision', async ({ site, dashboard, page }) => {
  const { revision } = await site.client().catalog.listLayers({ map: 'office' });
  await site.client().catalog.deleteLayer({ map: 'office', layer: 'objects' });
  await dashboard.open(site, { view: [12.2, 2.9, 0.02], at: revision });
  await dashboard.click(KITCHEN_CUP);
  const here = panel(page, 'At this point');
  await expect(here.getByRole('heading')).toContainText(`as of revision ${revision}`);
  await expect(here.getByRole('button', { name: 'cup' })).toBeVisible();
});

test('a search lists its results and marks them on the map', async ({ site, dashboard, page }) => {
  await dashboard.open(site, { view: [10, 6, 0.02] });
  const chair = [12.3, 2.05] as const;
  const before = await dashboard.colourAt(chair);
  await dashboard.panel('Search');
  await find(page, 'Chair');
  const answer = panel(page, 'Answer');
  await expect(answer.getByRole('status')).toHaveText(/^\d+ objects found$/);
  const count = Number(((await answer.getByRole('status').textContent()) ?? '').split(' ')[0]);
  await expect(answer.getByRole('listitem')).toHaveCount(count);
  await expect.poll(() => dashboard.colourAt(chair)).not.toBe(before);
  await answer.getByRole('button', { name: 'Show all on the map' }).click();
  await shot(page, 'search');

  const address = page.url();
  await found(page).first().getByRole('button').click();
  await expect.poll(() => page.url()).not.toBe(address);
  await page.getByRole('button', { name: 'Details', exact: true }).click();
  await expect(page.getByRole('article', { name: 'Object chair' })).toBeVisible();
});

test('cells are found by their value', async ({ site, dashboard, page }) => {
  await dashboard.open(site, { layers: ['floor'] });
  await dashboard.panel('Search');
  await find(page, 'unexplored');
  await expect(found(page, 'seen')).toHaveText(/[\d,]+ cells\s*[\d.]+ m²/);
  await shot(page, 'search_cells');
  await panel(page, 'Answer').getByText('layers without an answer').click();
  await expect(
    panel(page, 'Answer').getByText('does not support this value').first(),
  ).toBeVisible();
});

test('the nearest objects are ordered by distance', async ({ site, dashboard, page }) => {
  await dashboard.open(site, { view: [12.2, 2.9, 0.02] });
  await dashboard.panel('Search');
  await page.getByRole('button', { name: 'Nearest' }).click();
  await find(page, 'cup');
  const rows = found(page, 'By distance');
  await expect(rows.first()).toContainText('cup');
  const distances = (await rows.locator('.number').allTextContents()).map(parseFloat);
  expect(distances.length).toBeGreaterThan(1);
  expect(distances.every((distance) => distance >= 0)).toBe(true);
  expect(distances).toEqual(distances.toSorted((a, b) => a - b));
});

test('a drawn area is searched for all of its content, or for a value', async ({
  site,
  dashboard,
  page,
}) => {
  await dashboard.open(site, { view: [12.2, 2.9, 0.02] });
  await dashboard.panel('Search');
  await page.getByRole('button', { name: 'In an area' }).click();
  await page.getByRole('button', { name: 'Draw', exact: true }).click();
  await dashboard.draw(KITCHEN);
  const answer = panel(page, 'Answer');
  await expect(answer.getByRole('heading').first()).toContainText('Area of 19.7 m²');
  await expect(found(page).filter({ hasText: 'oven' })).toHaveCount(1);
  await expect(found(page, 'floor')).toHaveText(/cells/);
  await shot(page, 'area_query');

  await page.getByLabel('What to find').fill('cup');
  await page.getByRole('button', { name: 'Draw', exact: true }).click();
  await dashboard.draw(KITCHEN);
  await expect(answer.getByRole('status')).toHaveText('2 objects found');

  await answer.getByRole('button', { name: 'Clear the answer' }).click();
  await expect(answer).toHaveCount(0);
});

test('invalid values and empty answers are reported differently', async ({
  site,
  dashboard,
  page,
}) => {
  await dashboard.open(site);
  await dashboard.panel('Search');
  await find(page, 'unicorn');
  await expect(panel(page, 'Answer').getByRole('status')).toHaveText('nothing found');
  await find(page, '>>1');
  await expect(page.getByRole('alert')).toContainText('>>1');
});

test('an answer says that the map has changed since', async ({ site, dashboard, page }) => {
  await dashboard.open(site);
  await dashboard.panel('Search');
  await find(page, 'trolley');
  await expect(panel(page, 'Answer').getByRole('status')).toHaveText('nothing found');
  await putSquare(site, 'objects', 'trolley', EMPTY_FLOOR);
  await page.getByRole('button', { name: 'Ask again' }).click();
  await expect(panel(page, 'Answer').getByRole('status')).toHaveText('1 object found');
});

test('the answer for a point follows the changes of the map', async ({ site, dashboard, page }) => {
  await dashboard.open(site, { view: [...EMPTY_FLOOR, 0.02] });
  const [x, y] = EMPTY_FLOOR;
  await dashboard.click([x + 0.2, y + 0.2]);
  const here = panel(page, 'At this point');
  await expect(here).toContainText('floor');
  await expect(here.getByRole('button')).toHaveCount(0);
  await putSquare(site, 'objects', 'trolley', EMPTY_FLOOR);
  await expect(here.getByRole('button', { name: 'trolley' })).toBeVisible();
});

test('an answer follows the shown revision', async ({ site, dashboard, page }) => {
  await putSquare(site, 'objects', 'trolley', EMPTY_FLOOR);
  await dashboard.open(site);
  await dashboard.panel('Search');
  await find(page, 'trolley');
  const status = panel(page, 'Answer').getByRole('status');
  await expect(status).toHaveText('1 object found');
  await page.getByRole('button', { name: 'One revision back' }).click();
  await expect(status).toHaveText('nothing found');
  await page.getByRole('button', { name: 'Live', exact: true }).click();
  await expect(status).toHaveText('1 object found');
});
