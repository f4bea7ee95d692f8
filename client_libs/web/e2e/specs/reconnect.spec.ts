import type { Place } from '../support/dashboard.js';
import { putSquare } from '../support/edits.js';
import { expect, shot, test } from '../support/test.js';

const view = [7, 6, 0.01] as const;
// The corners of a trolley and a barrel, and places in them that their labels do not cover.
const trolleyCorner: Place = [6.25, 5.75];
const barrelCorner: Place = [7.25, 5.75];
const atTrolley: Place = [6.3, 5.8];
const atBarrel: Place = [7.3, 5.8];

test('a page survives a server restart and resumes where it was', async ({
  site,
  dashboard,
  page,
}) => {
  await dashboard.open(site, { layers: ['floor', 'objects'], view });
  await dashboard.panel('Changes');
  const floor = await dashboard.colourAt(atTrolley);
  await putSquare(site, 'objects', 'trolley', trolleyCorner);
  await expect.poll(() => dashboard.colourAt(atTrolley)).not.toBe(floor);
  const trolley = await dashboard.colourAt(atTrolley);

  await site.killServer();
  await dashboard.hasStatus('Disconnected');
  await expect(page.getByText("can't be reached")).toBeVisible();
  // The last known content stays visible.
  expect(await dashboard.colourAt(atTrolley)).toBe(trolley);
  await shot(page, 'disconnected');

  await site.restartServer();
  await putSquare(site, 'objects', 'barrel', barrelCorner);
  await dashboard.isLive();
  const rows = page.getByRole('list', { name: 'Changes' }).getByRole('listitem');
  await expect(rows.first()).toContainText('barrel');
  // No change is listed twice or lost.
  await expect(rows).toHaveCount(2);
  expect(await dashboard.colourAt(atTrolley)).toBe(trolley);
  await expect.poll(() => dashboard.colourAt(atBarrel)).not.toBe(floor);
});

test('an edit made while the server is away is refused, and can be made later', async ({
  site,
  dashboard,
  page,
}) => {
  await dashboard.open(site, { layers: ['floor', 'objects'], view });
  await dashboard.panel('Edit');
  await site.killServer();
  await dashboard.hasStatus('Disconnected');
  const form = page.getByRole('form', { name: 'New object' });
  await form.getByLabel('Class').fill('trolley');
  await form.getByRole('button', { name: 'Place a square' }).click();
  await expect(page.getByRole('alert')).toBeVisible();

  await site.restartServer();
  await dashboard.isLive();
  await form.getByRole('button', { name: 'Place a square' }).click();
  await expect(page.getByRole('heading', { name: 'Selected: trolley' })).toBeVisible();
});
