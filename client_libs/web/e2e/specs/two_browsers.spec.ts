import type { Place } from '../support/dashboard.js';
import { expect, shot, test } from '../support/test.js';

const view = [7, 6, 0.01] as const;
const middle: Place = [6.5, 6];
const corners: Place[] = [
  [6, 5.7],
  [7, 5.7],
  [7, 6.3],
  [6, 6.3],
];

test('two browsers see each other’s edits', async ({ site, dashboard, otherDashboard }) => {
  const options = { layers: ['floor', 'objects'], view };
  await Promise.all([dashboard.open(site, options), otherDashboard.open(site, options)]);
  const floor = await otherDashboard.colourAt(middle);
  expect(await dashboard.colourAt(middle)).toBe(floor);
  await otherDashboard.panel('Changes');

  // The first browser draws an object, which the second one shows.
  const { page } = dashboard;
  const { page: otherPage } = otherDashboard;
  await dashboard.panel('Edit');
  const form = page.getByRole('form', { name: 'New object' });
  await form.getByLabel('Class').fill('trolley');
  await form.getByRole('button', { name: 'Draw' }).click();
  await dashboard.draw(corners);
  const change = otherPage.getByRole('list', { name: 'Changes' }).getByRole('listitem').first();
  await expect(change).toContainText('trolley');
  await expect.poll(() => otherDashboard.colourAt(middle)).not.toBe(floor);
  await shot(otherPage, 'two_browsers');

  // The second browser deletes the object, and it disappears in the first one.
  await change.getByRole('button', { name: 'trolley' }).click();
  await otherDashboard.panel('Edit');
  await otherPage.getByRole('button', { name: 'Delete' }).click();
  await expect.poll(() => otherDashboard.colourAt(middle)).toBe(floor);
  await expect.poll(() => dashboard.colourAt(middle)).toBe(floor);

  // The first browser can't undo its drawing, because the object is gone, and says so.
  await page.getByRole('button', { name: 'Undo draw trolley' }).click();
  await expect(page.getByRole('alert')).toContainText('Somebody else has changed the object');
});
