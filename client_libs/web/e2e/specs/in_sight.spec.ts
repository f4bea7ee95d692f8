import type { Page } from '@playwright/test';

import type { Dashboard, Place } from '../support/dashboard.js';
import { putSquare } from '../support/edits.js';
import type { Site } from '../support/site.js';
import { expect, shot, stillScreenshot, test } from '../support/test.js';

/**
 * The lower left corner of a square trolley of half a metre, its centre, and a place near the
 * corner.
 */
const CORNER: Place = [6, 5.5];
const MIDDLE: Place = [6.25, 5.75];
const NEAR_CORNER: Place = [6.06, 5.56];

const panel = (page: Page, title: string) => page.getByRole('region', { name: title, exact: true });

/** The upper edge of a panel, pixels from the top. */
async function topOf(page: Page, title: string): Promise<number> {
  return (await panel(page, title).boundingBox())?.y ?? NaN;
}

/** Shows the trolley at an offset in pixels from the centre of the screen. */
async function openTrolley(
  dashboard: Dashboard,
  site: Site,
  [right, below]: readonly [number, number],
): Promise<void> {
  await putSquare(site, 'objects', 'trolley', CORNER);
  const view = [MIDDLE[0] - 0.01 * right, MIDDLE[1] + 0.01 * below, 0.01] as const;
  await dashboard.open(site, { layers: ['floor', 'objects'], view });
}

/** Takes a picture of a part of the map that no panel covers, once nothing moves. */
function picture(page: Page): Promise<Buffer> {
  return stillScreenshot(page, { clip: { x: 20, y: 90, width: 280, height: 200 } });
}

/** Counts the different pictures of one pixel column of the map during an action. */
async function countPictures(page: Page, act: () => Promise<void>): Promise<number> {
  await page.evaluate(() => {
    const seen = new Set<string>();
    Object.assign(window, { picturesSeen: seen });
    const look = (): void => {
      const canvas = document.querySelectorAll<HTMLCanvasElement>('.canvas-layer canvas')[0];
      const column = canvas?.getContext('2d')?.getImageData(60, 0, 1, canvas.height).data;
      if (column) seen.add(column.join());
      requestAnimationFrame(look);
    };
    look();
  });
  await act();
  return page.evaluate(
    () => (window as unknown as { picturesSeen: Set<string> }).picturesSeen.size,
  );
}

test.describe('on a phone', () => {
  test.use({ viewport: { width: 390, height: 844 }, hasTouch: true, isMobile: true });

  for (const colorScheme of ['light', 'dark'] as const) {
    test(`the clicked object is moved above the sheet, ${colorScheme}`, async ({
      site,
      dashboard,
      page,
    }) => {
      await page.emulateMedia({ colorScheme });
      await openTrolley(dashboard, site, [0, 230]);
      const colour = await dashboard.colourAt(NEAR_CORNER);
      const { x, y } = dashboard.at(MIDDLE);
      expect(y).toBeGreaterThan(600);
      await page.touchscreen.tap(x, y);
      await expect(page.getByRole('article', { name: 'Object trolley' })).toBeVisible();
      // The whole object is above the sheet, with a margin.
      await expect
        .poll(async () => dashboard.at(CORNER).y - (await topOf(page, 'Here')))
        .toBeLessThan(-20);
      expect(dashboard.at(MIDDLE).y).toBeGreaterThan(60);
      expect(await dashboard.colourAt(NEAR_CORNER)).toBe(colour);
      await expect(page.getByRole('article')).toContainText('added by hand');
      await shot(page, `phone_in_sight_${colorScheme}`);
    });
  }

  test('the map stays as it is when the sheet is closed', async ({ site, dashboard, page }) => {
    await openTrolley(dashboard, site, [0, 230]);
    const { x, y } = dashboard.at(MIDDLE);
    await page.touchscreen.tap(x, y);
    await expect(page.getByRole('article', { name: 'Object trolley' })).toBeVisible();
    await expect.poll(() => dashboard.at(MIDDLE).y).toBeLessThan(420);
    const before = await picture(page);
    await page.getByRole('button', { name: 'Close Here' }).tap();
    await expect(panel(page, 'Here')).toBeHidden();
    expect((await picture(page)).equals(before)).toBe(true);
  });

  test('an object that the user has moved out of the view is not brought back', async ({
    site,
    dashboard,
    page,
  }) => {
    await openTrolley(dashboard, site, [0, -100]);
    await dashboard.click(MIDDLE);
    await expect(page.getByRole('article', { name: 'Object trolley' })).toBeVisible();
    await page.getByRole('button', { name: 'Close Here' }).tap();
    for (let times = 0; times < 2; ++times) {
      await page.mouse.move(170, 120);
      await page.mouse.down();
      await page.mouse.move(170, 720, { steps: 5 });
      await page.mouse.up();
    }
    // The object has passed the lower edge of the screen, and the map is still in kinetic motion.
    await expect.poll(() => dashboard.at(MIDDLE).y).toBeGreaterThan(1000);
    await dashboard.panel('Search');
    await expect(panel(page, 'Search')).toBeVisible();
    await picture(page);
    expect(dashboard.at(MIDDLE).y).toBeGreaterThan(1000);
  });

  test('all of the map is fitted above the sheet', async ({ site, dashboard, page }) => {
    await dashboard.open(site);
    await dashboard.panel('Search');
    await page.getByRole('button', { name: 'Show all', exact: true }).tap();
    const lowest: Place = [0, 0];
    const highest: Place = [0, 12];
    await expect
      .poll(async () => dashboard.at(lowest).y - (await topOf(page, 'Search')))
      .toBeLessThan(0);
    expect(dashboard.at(highest).y).toBeGreaterThan(50);
  });

  test('zooming keeps the centre of the uncovered part in place', async ({
    site,
    dashboard,
    page,
  }) => {
    await openTrolley(dashboard, site, [0, 0]);
    await dashboard.panel('Search');
    const top = await topOf(page, 'Search');
    const header = await page.getByRole('banner').boundingBox();
    const middle = ((header?.height ?? NaN) + top) / 2;
    const [, y] = [195, middle];
    // The place at the centre of the uncovered part.
    const place: Place = [MIDDLE[0], MIDDLE[1] + 0.01 * (422 - y)];
    const address = page.url();
    await page.getByRole('button', { name: 'Zoom in' }).tap();
    await expect.poll(() => page.url()).not.toBe(address);
    expect(Math.abs(dashboard.at(place).y - y)).toBeLessThan(2);
  });

  test('a map that was visible as a whole still is when the sheet opens', async ({
    site,
    dashboard,
    page,
  }) => {
    await dashboard.open(site);
    await dashboard.panel('Search');
    const lowest: Place = [0, 0];
    await expect
      .poll(async () => dashboard.at(lowest).y - (await topOf(page, 'Search')))
      .toBeLessThan(0);
  });

  test('the map moves without animation if the user prefers reduced motion', async ({
    site,
    dashboard,
    page,
  }) => {
    await page.emulateMedia({ reducedMotion: 'reduce' });
    await openTrolley(dashboard, site, [0, 230]);
    const { x, y } = dashboard.at(MIDDLE);
    const count = await countPictures(page, async () => {
      await page.touchscreen.tap(x, y);
      await expect(page.getByRole('article', { name: 'Object trolley' })).toBeVisible();
      await expect.poll(() => dashboard.at(MIDDLE).y).toBeLessThan(420);
      await picture(page);
    });
    // One picture before, one after the sheet has opened, and one after its content has loaded.
    expect(count).toBeGreaterThan(1);
    expect(count).toBeLessThanOrEqual(4);
  });
});

test('on a wide screen the clicked object is moved beside the panel', async ({
  site,
  dashboard,
  page,
}) => {
  await openTrolley(dashboard, site, [500, 0]);
  const colour = await dashboard.colourAt(NEAR_CORNER);
  await dashboard.click(MIDDLE);
  await expect(page.getByRole('article', { name: 'Object trolley' })).toBeVisible();
  const left = (await panel(page, 'Here').boundingBox())?.x ?? NaN;
  await expect.poll(() => dashboard.at([6.5, 5.5]).x).toBeLessThan(left - 20);
  expect(await dashboard.colourAt(NEAR_CORNER)).toBe(colour);
});
