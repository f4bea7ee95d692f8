import type { Page } from '@playwright/test';

import { fillSquare, putSquare } from '../support/edits.js';
import { expect, shot, test } from '../support/test.js';

// The lower left corner of a square of half a metre on free floor of the corridor, and its centre.
const CORNER = [2.75, 5.65] as const;
const HERE = [3, 5.9] as const;

const slider = (page: Page) => page.getByRole('slider', { name: 'Revision' });

test('the slider shows earlier revisions, and a button returns to live', async ({
  site,
  dashboard,
  page,
}) => {
  await dashboard.open(site);
  const free = await dashboard.colourAt(HERE);
  const before = await slider(page).inputValue();
  await fillSquare(site, 'floor', CORNER, 1);
  await expect.poll(() => dashboard.colourAt(HERE)).not.toBe(free);
  const written = await dashboard.colourAt(HERE);

  await slider(page).fill(before);
  await expect(page.getByText(/^As of /)).toBeVisible();
  await expect.poll(() => dashboard.colourAt(HERE)).toBe(free);
  await shot(page, 'time_slider');

  await page.getByRole('button', { name: 'Back to live' }).click();
  await expect(page.getByText(/^As of /)).toBeHidden();
  await expect.poll(() => dashboard.colourAt(HERE)).toBe(written);
});

test('an earlier revision shows neither later content nor live changes', async ({
  site,
  dashboard,
  page,
}) => {
  await dashboard.open(site);
  const empty = await dashboard.colourAt(HERE);
  await slider(page).focus();
  await page.keyboard.press('Home');
  const panel = page.getByRole('region', { name: 'Layers' });
  await expect(panel.getByRole('listitem').filter({ hasText: 'objects' })).toContainText(
    'no content',
  );

  await page.getByRole('button', { name: 'Live', exact: true }).click();
  await page.getByRole('button', { name: 'One revision back' }).click();
  await expect(page.getByText(/^As of /)).toBeVisible();
  await putSquare(site, 'objects', 'trolley', CORNER);
  await expect.poll(async () => Number(await slider(page).getAttribute('max'))).toBe(12);
  await expect(slider(page)).toHaveValue('10');
  expect(await dashboard.colourAt(HERE)).toBe(empty);
  await page.getByRole('button', { name: 'Back to live' }).click();
  await expect.poll(() => dashboard.colourAt(HERE)).not.toBe(empty);
});

test('a time leads to the newest revision at that time', async ({ site, dashboard, page }) => {
  await dashboard.open(site);
  const id = await putSquare(site, 'objects', 'trolley', CORNER);
  // The input has a resolution of one second, so the next edit must fall into a later second.
  const second = Math.floor(Date.now() / 1000);
  await expect.poll(() => Math.floor(Date.now() / 1000)).toBeGreaterThan(second + 1);
  await putSquare(site, 'objects', 'trolley', [4.75, 5.65], id);
  await expect(slider(page)).toHaveAttribute('max', '13');

  const time = new Date((second + 1) * 1000);
  const text = await page.evaluate((ms) => {
    const local = new Date(ms - new Date(ms).getTimezoneOffset() * 60_000);
    return local.toISOString().slice(0, 19);
  }, time.getTime());
  await page.getByRole('button', { name: 'Go to a time' }).click();
  await page.getByLabel('Date and time').fill(text);
  await page.getByRole('button', { name: 'Go', exact: true }).click();
  await expect(slider(page)).toHaveValue('12');
  await expect(page.getByText(/^revision 12\b/)).toBeVisible();
});

test('the address keeps the shown revision', async ({ site, dashboard, page }) => {
  await dashboard.open(site);
  await page.keyboard.press('[');
  await page.keyboard.press('[');
  await expect(slider(page)).toHaveValue('9');
  await expect.poll(() => page.url()).toContain('at=9');
  await page.reload();
  await dashboard.isLive();
  await expect(slider(page)).toHaveValue('9');
  await expect(page.getByText(/^As of /)).toBeVisible();
  await page.keyboard.press(']');
  await expect(slider(page)).toHaveValue('10');
});

test('C5 an address of an earlier history of the map says so and shows the newest revision', async ({
  site,
  page,
}) => {
  await page.goto(`${site.url}/?map=office&at=9&of=1`);
  await expect(page.getByText(/^Revision 9 belongs to an earlier history/)).toBeVisible();
  await expect(page.getByText(/^As of /)).toBeHidden();
  await page.getByRole('button', { name: 'Dismiss' }).click();
  await expect(page.getByText(/^Revision 9 belongs/)).toBeHidden();
});

test('a revision that does not exist is reported', async ({ site, page }) => {
  await page.goto(`${site.url}/?map=office&at=4000`);
  await expect(page.getByRole('alert')).toContainText('Revision 4000');
  await page.getByRole('button', { name: 'Back to live' }).click();
  await expect(page.getByRole('alert')).toBeHidden();
});
