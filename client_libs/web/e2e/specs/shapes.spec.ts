import {
  LayerKind,
  shapeFromGeoJson,
  ShapeKind,
  shapeToGeoJson,
  type ShapeGeometry,
} from '@hypermap/client';
import type { Locator, Page } from '@playwright/test';

import type { Dashboard, Place } from '../support/dashboard.js';
import type { Site } from '../support/site.js';
import { expect, shot, test } from '../support/test.js';

// Places on free floor in the corridor, and a view around it in which 8 pixels are 8 cm.
const view = [7, 6, 0.01] as const;
const AREA: Place[] = [
  [4, 5.7],
  [5, 5.7],
  [5, 6.3],
  [4, 6.3],
];
const LANE: Place[] = [
  [5.5, 5.7],
  [7.5, 5.7],
  [7.5, 6.3],
];
const CHARGER: Place = [6.4, 6.2];

const IN_AREA: Place = [4.5, 6];
const ON_LANE: Place = [6.5, 5.7];
const BESIDE_LANE: Place = [6.5, 5.76];
const BESIDE_CHARGER: Place = [6.44, 6.16];
const EMPTY_FLOOR: Place = [8.6, 5.9];

const numbers = (places: readonly Place[]) => places.map(([x, y]) => [x, y]);

/** Creates a layer "ways" with a polygon, a line and a point, in one revision. */
async function drawWays(site: Site): Promise<void> {
  const put = (label: string, geometry: ShapeGeometry) => {
    const object = { label, shape: shapeFromGeoJson(geometry) };
    return { edit: { case: 'putObject' as const, value: { layer: 'ways', object } } };
  };
  const layer = { name: 'ways', kind: LayerKind.SEMANTIC };
  await site.client().edit.applyEdits({
    map: 'office',
    edits: [
      { edit: { case: 'createLayer', value: { layer } } },
      put('keep-out', { type: 'Polygon', coordinates: [numbers(AREA)] }),
      put('lane', { type: 'LineString', coordinates: numbers(LANE) }),
      put('charger', { type: 'Point', coordinates: [...CHARGER] }),
    ],
  });
}

/** Creates an empty layer whose objects have shapes of some kinds. */
async function createLayer(site: Site, name: string, ...shapeKinds: ShapeKind[]): Promise<void> {
  const layer = { name, kind: LayerKind.SEMANTIC, shapeKinds };
  await site.client().catalog.createLayer({ map: 'office', layer });
}

/** Queries the server for the shapes of the objects with a label. */
async function shapesOf(site: Site, label: string): Promise<(ShapeGeometry | null)[]> {
  const scope = { map: 'office', layers: ['ways'] };
  const shapes = [];
  for await (const { part } of site.client().query.queryValue({ scope, value: label })) {
    for (const { shape } of part?.objects ?? []) shapes.push(shape ? shapeToGeoJson(shape) : null);
  }
  return shapes;
}

/** The coordinates of the only object with a label, rounded to decimetres. */
async function coordinatesOf(site: Site, label: string): Promise<unknown> {
  const [shape, ...more] = await shapesOf(site, label);
  expect(more).toEqual([]);
  const round = (value: unknown): unknown =>
    Array.isArray(value) ? value.map(round) : Math.round(10 * Number(value)) / 10;
  return shape && round(shape.coordinates);
}

const card = (page: Page, label: string): Locator =>
  page.getByRole('article', { name: `Object ${label}` });

async function hover(dashboard: Dashboard, page: Page, place: Place): Promise<void> {
  const { x, y } = dashboard.at(place);
  await page.mouse.move(x, y);
}

/** Starts to draw an object with the tool for a kind of shape. */
async function startDrawing(page: Page, label: string, tool: string): Promise<void> {
  const form = page.getByRole('form', { name: 'New object' });
  await form.getByLabel('Class').fill(label);
  await form.getByLabel('Layer').selectOption('ways');
  await form.getByRole('button', { name: tool, exact: true }).click();
  await form.getByRole('button', { name: 'Draw' }).click();
}

test('a polygon, a line and a point are seen, hovered and clicked', async ({
  site,
  dashboard,
  page,
}) => {
  await drawWays(site);
  await dashboard.open(site, { layers: ['floor', 'objects', 'ways'], view });
  const row = page.getByRole('region', { name: 'Layers' }).getByRole('listitem');
  await expect(row.filter({ hasText: 'ways' })).toContainText('3');
  const floor = await dashboard.colourAt(EMPTY_FLOOR);
  for (const place of [IN_AREA, ON_LANE, CHARGER]) {
    await expect.poll(() => dashboard.colourAt(place)).not.toBe(floor);
  }

  const viewport = page.locator('.ol-viewport');
  await hover(dashboard, page, BESIDE_LANE);
  await expect(viewport).toHaveCSS('cursor', 'pointer');
  await hover(dashboard, page, EMPTY_FLOOR);
  await expect(viewport).not.toHaveCSS('cursor', 'pointer');

  await dashboard.click(BESIDE_LANE);
  await expect(card(page, 'lane')).toContainText('Length2.60 m');
  await dashboard.click(BESIDE_CHARGER);
  await expect(card(page, 'charger')).toContainText('Shapepoint');
  await expect(card(page, 'charger')).toContainText('Position6.40, 6.20');
  await expect(card(page, 'charger')).toContainText('added by hand');
  await shot(page, 'shapes');
  await dashboard.click(IN_AREA);
  await expect(card(page, 'keep-out')).toContainText('Area0.60 m²');
  // The click is as near to the polygon as an earlier one was to the lane, but a polygon must cover
  // the clicked place.
  await dashboard.click([4.5, 5.64]);
  await expect(page.getByRole('article')).toHaveCount(0);
});

test('lines and points are found and listed with their size', async ({ site, dashboard, page }) => {
  await drawWays(site);
  await dashboard.open(site, { layers: ['floor', 'ways'], view });
  const lane = await dashboard.colourAt(ON_LANE);
  await dashboard.panel('Search');
  await page.getByLabel('What to find').fill('lane');
  await page.getByRole('button', { name: 'Find', exact: true }).click();
  const found = page.getByRole('region', { name: 'Answer' }).getByRole('listitem');
  await expect(found).toHaveText(/lane line, 2\.60 m/);
  await expect.poll(() => dashboard.colourAt(ON_LANE)).not.toBe(lane);

  await page.getByLabel('What to find').fill('charger');
  await page.getByRole('button', { name: 'Find', exact: true }).click();
  await expect(found).toHaveText(/charger point/);
  const before = page.url();
  await found.getByRole('button').click();
  await expect.poll(() => page.url()).not.toBe(before);
});

test('lines and points are drawn, reshaped, deleted and undone', async ({
  site,
  dashboard,
  page,
}) => {
  await createLayer(site, 'ways');
  await dashboard.open(site, { layers: ['floor', 'ways'], view });
  await dashboard.panel('Edit');
  const selected = page.getByRole('region', { name: 'Selected object' });
  const keep = selected.getByRole('button', { name: 'Keep shape' });

  await startDrawing(page, 'lane', 'Line');
  await dashboard.draw(LANE);
  await expect(page.getByRole('heading', { name: 'Selected: lane' })).toBeVisible();
  expect(await coordinatesOf(site, 'lane')).toEqual(numbers(LANE));
  await selected.getByRole('button', { name: 'Edit shape' }).click();
  await dashboard.drag([7.5, 6.3], [8.5, 6.1]);
  await shot(page, 'edit_line');
  await keep.click();
  const reshaped = [...numbers(LANE.slice(0, 2)), [8.5, 6.1]];
  await expect.poll(() => coordinatesOf(site, 'lane')).toEqual(reshaped);

  await startDrawing(page, 'charger', 'Point');
  await dashboard.click(CHARGER);
  await expect(page.getByRole('heading', { name: 'Selected: charger' })).toBeVisible();
  expect(await coordinatesOf(site, 'charger')).toEqual([...CHARGER]);
  await selected.getByRole('button', { name: 'Edit shape' }).click();
  await dashboard.drag(CHARGER, [5.8, 6]);
  await keep.click();
  await expect.poll(() => coordinatesOf(site, 'charger')).toEqual([5.8, 6]);

  // A key is ignored while the previous edit waits for its answer.
  const isNextToUndo = (title: string) =>
    expect(page.getByRole('button', { name: `Undo ${title}` })).toBeEnabled();
  await isNextToUndo('reshape charger');
  await page.getByRole('application', { name: 'Map' }).focus();
  await page.keyboard.press('Delete');
  await isNextToUndo('delete charger');
  expect(await shapesOf(site, 'charger')).toEqual([]);
  await page.keyboard.press('Control+z');
  await isNextToUndo('reshape charger');
  expect(await coordinatesOf(site, 'charger')).toEqual([5.8, 6]);
  await page.keyboard.press('Control+z');
  await isNextToUndo('draw charger');
  expect(await coordinatesOf(site, 'charger')).toEqual([...CHARGER]);
  await page.keyboard.press('Control+z');
  await isNextToUndo('reshape lane');
  expect(await shapesOf(site, 'charger')).toEqual([]);
  await page.keyboard.press('Control+z');
  await isNextToUndo('draw lane');
  expect(await coordinatesOf(site, 'lane')).toEqual(numbers(LANE));
});

test('a layer is drawn on with the kinds of shape that it takes', async ({
  site,
  dashboard,
  page,
}) => {
  await createLayer(site, 'ways', ShapeKind.LINE_STRING, ShapeKind.POINT);
  await createLayer(site, 'spots', ShapeKind.POINT);
  await dashboard.open(site, { layers: ['floor', 'ways', 'spots'], view });
  await dashboard.panel('Edit');
  const form = page.getByRole('form', { name: 'New object' });
  const tools = form.getByRole('group', { name: 'Shape to draw' });
  await form.getByLabel('Layer').selectOption('objects');
  await expect(tools.getByRole('button')).toHaveText(['Polygon', 'Line', 'Point']);
  await form.getByLabel('Layer').selectOption('ways');
  await expect(tools.getByRole('button')).toHaveText(['Line', 'Point']);
  await expect(tools.getByRole('button', { name: 'Line' })).toHaveAttribute('aria-pressed', 'true');
  await form.getByLabel('Layer').selectOption('spots');
  await expect(tools).toHaveCount(0);

  await form.getByLabel('Class').fill('charger');
  await form.getByRole('button', { name: 'Place a point' }).click();
  await expect(page.getByRole('heading', { name: 'Selected: charger' })).toBeVisible();
});

test('lines and points follow the changes of other clients and the time slider', async ({
  site,
  dashboard,
  page,
}) => {
  await drawWays(site);
  await dashboard.open(site, { layers: ['floor', 'ways'], view });
  const floor = await dashboard.colourAt(EMPTY_FLOOR);
  await expect.poll(() => dashboard.colourAt(ON_LANE)).not.toBe(floor);
  const lane = await dashboard.colourAt(ON_LANE);

  const scope = { map: 'office', layers: ['ways'] };
  const { layers } = await site.client().query.queryPoint({
    scope,
    point: { x: ON_LANE[0], y: ON_LANE[1] },
    toleranceM: 0.01,
  });
  const [object] = layers.flatMap(({ objects }) => objects);
  const shape = shapeFromGeoJson({
    type: 'LineString',
    coordinates: [
      [8.2, 5.9],
      [9, 5.9],
    ],
  });
  const value = { layer: 'ways', object: { id: object?.id ?? 0n, label: 'lane', shape } };
  await site.client().edit.applyEdits({
    map: 'office',
    edits: [{ edit: { case: 'putObject', value } }],
  });
  await expect.poll(() => dashboard.colourAt(EMPTY_FLOOR)).toBe(lane);
  await expect.poll(() => dashboard.colourAt(ON_LANE)).toBe(floor);

  await dashboard.panel('Changes');
  const change = page.getByRole('list', { name: 'Changes' }).getByRole('listitem');
  await expect(change.filter({ hasText: 'lane' })).toContainText('changed');
  await page.getByRole('button', { name: 'One revision back' }).click();
  await expect(page.getByText(/^As of /)).toBeVisible();
  await expect.poll(() => dashboard.colourAt(ON_LANE)).toBe(lane);
  expect(await dashboard.colourAt(EMPTY_FLOOR)).toBe(floor);
  await page.getByRole('button', { name: 'Back to live' }).click();
  await expect.poll(() => dashboard.colourAt(EMPTY_FLOOR)).toBe(lane);
});
