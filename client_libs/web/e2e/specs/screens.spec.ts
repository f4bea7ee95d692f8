import type { Page } from '@playwright/test';

import { claimGoals } from '../support/robots.js';
import { expect, shot, test } from '../support/test.js';

const screens = [
  { name: 'phone', width: 390, height: 844 },
  { name: 'tablet', width: 820, height: 1180 },
  { name: 'wall', width: 3840, height: 2160 },
];

const titles = ['Search', 'Here', 'Edit', 'Changes', 'Explore', 'Align', 'Export'];

/**
 * Describes the parts of the page that leave the screen, overlap each other, or cut off content.
 */
async function misfits(page: Page): Promise<string[]> {
  return page.evaluate(() => {
    const nameOf = (e: Element) =>
      e.getAttribute('aria-label') ?? e.getAttribute('aria-labelledby') ?? e.className;
    const parts = [...document.querySelectorAll('.card, .sheet, nav')].filter(
      (e) => e.getClientRects().length > 0,
    );
    const found: string[] = [];
    for (const part of parts) {
      const { left, top, right, bottom } = part.getBoundingClientRect();
      if (left < -1 || top < -1 || right > innerWidth + 1 || bottom > innerHeight + 1) {
        found.push(`${nameOf(part)} reaches out of the screen`);
      }
      for (const other of parts) {
        if (part === other || part.contains(other) || other.contains(part)) continue;
        const box = other.getBoundingClientRect();
        const over =
          left < box.right - 1 &&
          box.left < right - 1 &&
          top < box.bottom - 1 &&
          box.top < bottom - 1;
        if (over) found.push(`${nameOf(part)} lies over ${nameOf(other)}`);
      }
    }
    for (const part of document.querySelectorAll('.card, .panel-content, nav')) {
      if (part.scrollWidth > part.clientWidth + 1) {
        found.push(`${nameOf(part)} is wider than its place`);
      }
    }
    if (document.documentElement.scrollWidth > innerWidth) found.push('the page scrolls sideways');
    return found;
  });
}

test.describe('by touch', () => {
  test.use({ viewport: { width: 390, height: 844 }, hasTouch: true, isMobile: true });

  test('an object is drawn on a phone', async ({ site, dashboard, page }) => {
    await dashboard.open(site, { layers: ['floor', 'objects'], view: [7, 5, 0.02] });
    await dashboard.panel('Edit');
    const form = page.getByRole('form', { name: 'New object' });
    await form.getByLabel('Class').fill('trolley');
    await form.getByRole('button', { name: 'Draw' }).tap();
    const corners = [
      [6, 5.7],
      [7, 5.7],
      [7, 6.3],
      [6, 6.3],
      [6, 6.3],
    ] as const;
    for (const corner of corners) {
      const { x, y } = dashboard.at(corner);
      await page.touchscreen.tap(x, y);
    }
    await expect(page.getByRole('heading', { name: 'Selected: trolley' })).toBeVisible();
    expect(await misfits(page)).toEqual([]);
    await shot(page, 'phone_edit');
  });
});

for (const { name, width, height } of screens) {
  test.describe(name, () => {
    test.use({ viewport: { width, height } });

    test('all panels fit', async ({ exploredSite, dashboard, page }) => {
      await claimGoals(exploredSite);
      await dashboard.open(exploredSite);
      expect(await misfits(page)).toEqual([]);
      await shot(page, name);
      for (const title of titles) {
        await dashboard.panel(title);
        await expect(page.getByRole('region', { name: title, exact: true })).toBeVisible();
        expect(await misfits(page), `with ${title}`).toEqual([]);
        if (title === 'Explore') {
          await expect(page.getByRole('progressbar')).toBeVisible();
          await shot(page, `${name}_exploration`);
        }
      }
    });
  });
}

test('the page follows the dark colour scheme of the system', async ({
  exploredSite,
  dashboard,
  page,
}) => {
  await claimGoals(exploredSite);
  await dashboard.open(exploredSite);
  const light = await dashboard.colourAt([-1, -1]);
  await page.emulateMedia({ colorScheme: 'dark' });
  await expect.poll(() => dashboard.colourAt([-1, -1])).not.toBe(light);
  const brightness = (colour: string) => Math.max(...colour.split(',').map(Number));
  expect(brightness(await dashboard.colourAt([-1, -1]))).toBeLessThan(80);
  await dashboard.panel('Explore');
  await expect(page.getByRole('progressbar')).toBeVisible();
  await shot(page, 'dark');
});
