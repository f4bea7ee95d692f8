import type { Page } from '@playwright/test';
import { PNG } from 'pngjs';

import type { Dashboard, Place } from '../support/dashboard.js';
import { putSquare } from '../support/edits.js';
import { claimGoals } from '../support/robots.js';
import { expect, shot, test } from '../support/test.js';

/** The screens and their bounds: the font size (text to most) and the height of buttons, pixels. */
const screens = [
  { name: 'desk', width: 1440, height: 900, text: 14, most: 14, button: 32 },
  { name: 'desk_full_hd', width: 1920, height: 1080, text: 14, most: 14, button: 32 },
  { name: 'large', width: 2560, height: 1440, text: 17, most: 20, button: 40 },
  { name: 'wall', width: 3840, height: 2160, text: 28, most: 30, button: 64 },
  { name: 'low', width: 3840, height: 1080, text: 15, most: 20, button: 34 },
];

interface Sizes {
  /** The font sizes of the body, of the smallest panel, and of the smallest text, pixels. */
  body: number;
  panel: number;
  smallest: number;
  /** The height of the lowest button in the rail and the panels, pixels. */
  button: number;
  /** The share of the screen's width that the layer list and the open panel take. */
  covered: number;
  /** The number of pixels by which the page is wider than the screen. */
  overflow: number;
}

async function sizes(page: Page): Promise<Sizes> {
  return page.evaluate(() => {
    const letters = (e: Element) => parseFloat(getComputedStyle(e).fontSize);
    const all = (selector: string) => [...document.querySelectorAll(selector)];
    const texts = all('.card, .card *').filter((e) =>
      [...e.childNodes].some(
        (node) => node.nodeType === Node.TEXT_NODE && node.textContent?.trim(),
      ),
    );
    const panels = all('section.panel');
    const buttons = all('.panel button.primary, .panel header button, .tabs button');
    return {
      body: letters(document.body),
      panel: Math.min(...panels.map(letters)),
      smallest: Math.min(...texts.filter((e) => !(e instanceof SVGElement)).map(letters)),
      button: Math.min(...buttons.map((e) => e.getBoundingClientRect().height)),
      covered: panels.reduce((sum, e) => sum + e.getBoundingClientRect().width, 0) / innerWidth,
      overflow: document.documentElement.scrollWidth - innerWidth,
    };
  });
}

for (const { name, width, height, text, most, button } of screens) {
  test.describe(name, () => {
    test.use({ viewport: { width, height } });

    test('text and buttons have the size for the viewing distance of the screen', async ({
      exploredSite,
      dashboard,
      page,
    }) => {
      await claimGoals(exploredSite);
      await dashboard.open(exploredSite);
      await dashboard.panel('Explore');
      await expect(page.getByRole('progressbar')).toBeVisible();
      const found = await sizes(page);
      for (const size of [found.body, found.panel]) {
        expect(size).toBeGreaterThanOrEqual(text);
        expect(size).toBeLessThanOrEqual(most);
      }
      expect(found.smallest).toBeGreaterThanOrEqual(text * 0.75);
      expect(found.button).toBeGreaterThanOrEqual(button);
      expect(found.overflow).toBe(0);
      // The same share as at a width of 1920 pixels, where the two take 300 and 340 pixels.
      if (width >= 1920) expect(found.covered).toBeLessThanOrEqual(640 / 1920 + 0.001);
      if (name !== 'desk') await shot(page, `screen_${name}`);
    });
  });
}

/** Measures the height of the capitals at the centre of a square, pixels. */
async function letterHeight(dashboard: Dashboard, middle: Place, side: number): Promise<number> {
  const { x, y } = dashboard.at(middle);
  const clip = {
    x: Math.round(x - side / 2),
    y: Math.round(y - side / 2),
    width: side,
    height: side,
  };
  const { data } = PNG.sync.read(await dashboard.page.screenshot({ clip }));
  const rows = Array.from({ length: side }, (_, row) => {
    const pixels = data.subarray(4 * side * row, 4 * side * (row + 1));
    const lights = Array.from({ length: side }, (_, i) =>
      pixels.subarray(4 * i, 4 * i + 3).reduce((sum, part) => sum + part, 0),
    );
    return Math.min(...lights);
  });
  const darkest = Math.min(...rows);
  const dark = rows.flatMap((light, row) => (light < darkest + 60 ? [row] : []));
  return (dark.at(-1) ?? 0) - (dark.at(0) ?? 0) + 1;
}

test('labels on the map scale with the screen', async ({ site, dashboard, page }) => {
  await putSquare(site, 'objects', 'HHHH', [6, 5.6]);
  const middle: Place = [6.25, 5.85];
  const heights: number[] = [];
  for (const { width, height, scale } of [
    { width: 1440, height: 900, scale: 1 },
    { width: 3840, height: 2160, scale: 2 },
  ]) {
    await page.setViewportSize({ width, height });
    await dashboard.open(site, { layers: ['objects'], view: [6.25, 5.85, 0.005 / scale] });
    let height_px = NaN;
    const measure = async () => {
      height_px = await letterHeight(dashboard, middle, 60 * scale);
      return height_px;
    };
    await expect.poll(measure).toBeLessThan(20 * scale);
    heights.push(height_px);
  }
  const [desk = NaN, wall = NaN] = heights;
  expect(desk).toBeGreaterThanOrEqual(6);
  expect(wall / desk).toBeGreaterThan(1.75);
  expect(wall / desk).toBeLessThan(2.25);
});

test.describe('on the wall in the dark', () => {
  test.use({ viewport: { width: 3840, height: 2160 }, colorScheme: 'dark' });

  test('shows an object card with its chart and the marked object', async ({
    exploredSite,
    dashboard,
    page,
  }) => {
    await dashboard.open(exploredSite, { view: [7, 6, 0.006] });
    await dashboard.click([6.75, 9.9]);
    const card = page.getByRole('article', { name: 'Object couch' });
    await expect(card.getByRole('img', { name: /Existence over time/ })).toBeVisible();
    await shot(page, 'wall_dark');
  });

  test('the help scales like the rest of the page', async ({ site, dashboard, page }) => {
    await dashboard.open(site);
    await page.keyboard.press('?');
    const keys = page.getByRole('dialog', { name: 'Keys' });
    const letters = await keys.evaluate((e) => parseFloat(getComputedStyle(e).fontSize));
    expect(letters).toBeGreaterThanOrEqual(28);
    expect((await keys.boundingBox())?.width).toBeGreaterThanOrEqual(800);
  });
});
