import AxeBuilder from '@axe-core/playwright';
import type { Page } from '@playwright/test';

import { expect, test } from '../support/test.js';

/** The accessible name of the focused element. */
async function focused(page: Page): Promise<string> {
  return page.evaluate(() => {
    const element = document.activeElement;
    const label = element?.getAttribute('aria-label') ?? element?.closest('label')?.textContent;
    return (label ?? element?.textContent ?? '').trim();
  });
}

/** The violations that axe finds in a part of the page. */
async function breaches(
  page: Page,
  part: string,
  rules: readonly string[] = [],
): Promise<string[]> {
  const axe = new AxeBuilder({ page }).include(part);
  if (rules.length > 0) axe.withRules([...rules]);
  const { violations } = await axe.analyze();
  return violations.map(({ id, nodes }) => `${id}: ${nodes.map(({ html }) => html).join(' ')}`);
}

const panels = [
  { key: 'e', title: 'Edit' },
  { key: 'c', title: 'Changes' },
  { key: 'x', title: 'Explore' },
];

test('all controls can be reached with Tab, and the focus is visible', async ({
  site,
  dashboard,
  page,
}) => {
  await dashboard.open(site);
  await dashboard.panel('Edit');
  const all = await page
    .locator('button:enabled, input:enabled, select:enabled, [tabindex="0"]')
    .filter({ visible: true })
    .count();
  const reached = new Set<string>();
  await page.locator('body').focus();
  for (let i = 0; i <= all; i++) {
    await page.keyboard.press('Tab');
    // After the last element the focus moves to the browser.
    if (await page.evaluate(() => document.activeElement === document.body)) continue;
    reached.add(await focused(page));
    const outline = await page.evaluate(
      () => getComputedStyle(document.activeElement ?? document.body).outlineStyle,
    );
    expect(outline, `focus on "${await focused(page)}"`).not.toBe('none');
  }
  for (const name of ['Map', 'Edit', 'Draw', 'Close Edit', 'Zoom in']) {
    expect([...reached].join('\n')).toContain(name);
  }
});

test('keys open panels, move the map, and Escape closes', async ({ site, dashboard, page }) => {
  await dashboard.open(site);
  for (const { key, title } of panels) {
    await page.keyboard.press(key);
    await expect(page.getByRole('region', { name: title, exact: true })).toBeVisible();
  }
  await page.keyboard.press('Escape');
  await expect(page.getByRole('region', { name: 'Explore', exact: true })).toBeHidden();

  const map = page.getByRole('application', { name: 'Map' });
  for (const key of ['ArrowRight', 'ArrowUp', '+', '-', '0']) {
    await map.focus();
    const before = page.url();
    await page.keyboard.press(key);
    await expect.poll(() => page.url(), `after ${key}`).not.toBe(before);
  }
});

test('zoom keys in quick succession add up', async ({ site, dashboard, page }) => {
  await dashboard.open(site, { view: [10, 6, 0.06] });
  // All keys are pressed in one turn of the page, before the first step has painted anything.
  await page.getByRole('application', { name: 'Map' }).evaluate((map) => {
    for (const key of ['+', '-', '-', '-']) {
      map.dispatchEvent(new KeyboardEvent('keydown', { key, bubbles: true, cancelable: true }));
    }
  });
  await expect.poll(() => page.url()).toMatch(/,0\.24$/);
});

test('an object is created, deleted and restored without a pointer', async ({
  site,
  dashboard,
  page,
}) => {
  await dashboard.open(site, { view: [7, 6, 0.01] });
  await page.keyboard.press('e');
  const label = page.getByRole('form', { name: 'New object' }).getByLabel('Class');
  await label.focus();
  await page.keyboard.type('trolley');
  const place = page.getByRole('button', { name: 'Place a square' });
  for (let i = 0; i < 8 && !(await place.evaluate((e) => e === document.activeElement)); i++) {
    await page.keyboard.press('Tab');
  }
  await page.keyboard.press('Enter');
  const heading = page.getByRole('heading', { name: 'Selected: trolley' });
  await expect(heading).toBeVisible();
  await page.keyboard.press('Delete');
  await expect(heading).toBeHidden();
  // A key is ignored while the previous edit waits for its answer.
  await expect(page.getByRole('button', { name: 'Undo delete trolley' })).toBeEnabled();
  await page.keyboard.press('Control+z');
  await expect(heading).toBeVisible();
});

const schemes = [
  { colorScheme: 'light', rules: [] },
  { colorScheme: 'dark', rules: ['color-contrast'] },
] as const;

for (const { colorScheme, rules } of schemes) {
  test(`axe finds no accessibility violation, ${colorScheme}`, async ({
    exploredSite,
    dashboard,
    page,
  }) => {
    await page.emulateMedia({ colorScheme });
    await dashboard.open(exploredSite);
    expect(await breaches(page, 'body', rules)).toEqual([]);
    for (const title of ['Search', 'Here', 'Edit', 'Changes', 'Explore', 'Align', 'Export']) {
      await dashboard.panel(title);
      const panel = page.getByRole('region', { name: title, exact: true });
      await expect(panel).toBeVisible();
      const id = await panel.getAttribute('aria-labelledby');
      expect(await breaches(page, `[aria-labelledby="${id}"]`, rules), `in ${title}`).toEqual([]);
    }
  });
}
