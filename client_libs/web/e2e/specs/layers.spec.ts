import { classTextColour } from '../../dashboard/src/map/colours.js';
import { polygonShape, putSquare } from '../support/edits.js';
import { expect, shot, test } from '../support/test.js';

// A place on free floor that is explored, and a place inside the couch of the lounge.
const FLOOR = [2, 6.4] as const;
const COUCH = [6.6, 9.6] as const;

test('lists the layers of the map with the extent of their content', async ({
  site,
  dashboard,
  page,
}) => {
  await dashboard.open(site);
  const panel = page.getByRole('region', { name: 'Layers' });
  for (const title of ['Objects', 'Measurements', 'Explored area', 'Occupancy']) {
    await expect(panel.getByRole('heading', { name: title })).toBeVisible();
  }
  const dock = panel.getByRole('listitem').filter({ hasText: 'dock' });
  await expect(dock).toContainText('11');
  await expect(panel.getByRole('listitem').filter({ hasText: 'floor' })).toContainText('5 cm');
});

test('a layer is hidden and shown again', async ({ site, dashboard, page }) => {
  await dashboard.open(site);
  const shown = await dashboard.colourAt(COUCH);
  const objects = page.getByRole('checkbox', { name: 'objects' });
  await objects.uncheck();
  await expect.poll(() => dashboard.colourAt(COUCH)).not.toBe(shown);
  await objects.check();
  await expect.poll(() => dashboard.colourAt(COUCH)).toBe(shown);
});

test('opacity makes a layer fainter, down to nothing', async ({ site, dashboard, page }) => {
  await dashboard.open(site, { layers: ['floor', 'seen'] });
  const full = await dashboard.colourAt(FLOOR);
  await page.getByRole('button', { name: 'Details of seen' }).click();
  await page.getByRole('slider', { name: 'Opacity of seen' }).fill('0');
  await expect.poll(() => dashboard.colourAt(FLOOR)).not.toBe(full);
  const faint = await dashboard.colourAt(FLOOR);
  await page.getByRole('checkbox', { name: 'seen' }).uncheck();
  await expect.poll(() => page.url()).not.toContain('seen');
  expect(await dashboard.colourAt(FLOOR)).toBe(faint);
});

test('labels are above the objects of all layers', async ({ site, dashboard }) => {
  await site.hypermap('layer', 'create', 'office', 'over', '--kind', 'semantic');
  const shape = polygonShape([
    [5.5, 5.25],
    [7, 5.25],
    [7, 6.25],
    [5.5, 6.25],
  ]);
  const value = { layer: 'objects', object: { label: 'HHHH', existence: 1, shape } };
  const edits = [{ edit: { case: 'putObject' as const, value } }];
  await site.client().edit.applyEdits({ map: 'office', edits });
  await dashboard.open(site, { layers: ['objects', 'over'], view: [6.25, 5.75, 0.02] });
  const letterPixels = async () => {
    const picture = await dashboard.picture();
    const { x, y } = dashboard.at([6.25, 5.75]);
    const places = [...Array(7 * 21).keys()].map((i) => ({
      x: x - 10 + (i % 21),
      y: y - 3 + Math.floor(i / 21),
    }));
    return places.filter((at) => picture.has(classTextColour('HHHH', false), at, 30)).length;
  };
  await expect.poll(letterPixels).toBeGreaterThan(20);
  const pixels = await letterPixels();

  // The square is too small for a label of its own.
  const beside = [6.05, 5.55] as const;
  const uncovered = await dashboard.colourAt(beside);
  await putSquare(site, 'over', 'cover', [6, 5.5]);
  await expect.poll(() => dashboard.colourAt(beside)).not.toBe(uncovered);
  expect(await letterPixels()).toBe(pixels);
});

test('the legend shows classes, ranges and units', async ({ site, dashboard, page }) => {
  await dashboard.open(site);
  await page.getByRole('checkbox', { name: 'wifi' }).check();
  for (const layer of ['objects', 'wifi', 'seen', 'floor']) {
    await page.getByRole('button', { name: `Details of ${layer}` }).click();
  }
  const panel = page.getByRole('region', { name: 'Layers' });
  await expect(panel.getByRole('listitem').filter({ hasText: /^chair15$/ })).toBeVisible();
  await expect(panel).toContainText('-78 dBm');
  await expect(panel).toContainText('-42 dBm');
  await expect(panel).toContainText('unexplored');
  await shot(page, 'layers');
  await panel.getByRole('button', { name: /more classes/ }).click();
  await expect(panel.getByRole('listitem').filter({ hasText: /^refrigerator1$/ })).toBeVisible();
});

test('another map is chosen from the list', async ({ site, dashboard, page }) => {
  await site.hypermap('map', 'create', 'annex');
  await dashboard.open(site);
  const maps = page.getByRole('combobox', { name: 'Map', exact: true });
  await maps.selectOption('annex');
  await expect(page.getByText('This map has no layers yet.')).toBeVisible();
  await site.hypermap('layer', 'create', 'annex', 'things', '--kind', 'semantic');
  await expect(page.getByRole('checkbox', { name: 'things' })).toBeVisible();
  await maps.selectOption('office');
  await expect(page.getByRole('checkbox', { name: 'floor' })).toBeVisible();
});

test('the address keeps the view and the visible layers', async ({ site, dashboard, page }) => {
  await dashboard.open(site, { view: [12, 3, 0.01] });
  await page.getByRole('checkbox', { name: 'objects' }).uncheck();
  await page.getByRole('checkbox', { name: 'wifi' }).check();
  await expect.poll(() => page.url()).toContain('wifi');
  const url = page.url();
  const colour = await dashboard.colourAt([12, 3]);

  await page.goto('about:blank');
  await page.goto(url);
  await dashboard.isLive();
  await expect(page.getByRole('checkbox', { name: 'objects' })).not.toBeChecked();
  await expect(page.getByRole('checkbox', { name: 'wifi' })).toBeChecked();
  await expect.poll(() => dashboard.colourAt([12, 3])).toBe(colour);
  expect(page.url()).toBe(url);
});
