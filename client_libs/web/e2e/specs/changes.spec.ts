import type { Locator, Page } from '@playwright/test';

import type { Place } from '../support/dashboard.js';
import { deleteObject, fillSquare, putSquare } from '../support/edits.js';
import { expect, shot, test } from '../support/test.js';

const rows = (page: Page): Locator =>
  page.getByRole('list', { name: 'Changes' }).getByRole('listitem');

test('changes are listed when they arrive, newest first', async ({ site, dashboard, page }) => {
  await dashboard.open(site);
  await dashboard.panel('Changes');
  await expect(page.getByText('Nothing has changed')).toBeVisible();

  const id = await putSquare(site, 'objects', 'trolley', [6, 5.7]);
  await expect(rows(page).first()).toContainText('added');
  await expect(rows(page).first()).toContainText('trolley');

  await deleteObject(site, 'objects', id);
  await expect(rows(page).first()).toContainText('removed');
  await expect(rows(page).first()).toContainText('trolley');
  await expect(rows(page)).toHaveCount(2);

  // One robot moves a barrel, another one explores: repeated changes are joined to one line each.
  const barrel = await putSquare(site, 'objects', 'barrel', [5, 5.7]);
  for (const x of [5.5, 6, 6.5]) await putSquare(site, 'objects', 'barrel', [x, 5.7], barrel);
  for (const x of [7.5, 8, 8.5]) await fillSquare(site, 'seen', [x, 4.2], 1);
  await putSquare(site, 'objects', 'suitcase', [12.4, 5.7]);
  await expect(rows(page)).toHaveCount(6);
  await expect(rows(page).nth(1)).toContainText(/cells.*seen, \d times/s);
  await expect(rows(page).nth(2)).toContainText(/changed.*barrel.*3 times/s);
  await shot(page, 'changes');

  const panel = page.getByRole('region', { name: 'Changes' });
  await panel.getByLabel('Layer').selectOption('objects');
  await expect(rows(page)).toHaveCount(5);
});

test('a change leads to its object, and to the map as it was then', async ({
  site,
  dashboard,
  page,
}) => {
  await dashboard.open(site, { view: [40, 40, 0.05] });
  await dashboard.panel('Changes');
  await putSquare(site, 'objects', 'trolley', [6, 5.7]);
  const before = page.url();
  await rows(page).first().getByRole('button', { name: 'trolley' }).click();
  await expect.poll(() => page.url()).not.toBe(before);
  await expect.poll(() => dashboard.at([6.25, 5.95]).x).toBeGreaterThan(0);

  const barrel: Place = [7.25, 5.95];
  const floor = await dashboard.colourAt(barrel);
  await putSquare(site, 'objects', 'barrel', [7, 5.7]);
  await expect.poll(() => dashboard.colourAt(barrel)).not.toBe(floor);
  const trolleyRow = rows(page).filter({ hasText: 'trolley' });
  await trolleyRow.getByRole('button', { name: 'revision' }).click();
  await expect(page.getByRole('button', { name: 'Back to live' })).toBeVisible();
  await expect.poll(() => dashboard.colourAt(barrel)).toBe(floor);
});
