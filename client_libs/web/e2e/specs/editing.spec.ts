import { ObjectEventKind } from '@hypermap/client';
import type { Page } from '@playwright/test';

import type { Place } from '../support/dashboard.js';
import { polygonShape } from '../support/edits.js';
import type { Site } from '../support/site.js';
import { expect, shot, test } from '../support/test.js';

// A rectangle on free floor in the corridor, and a view around it.
const view = [7, 6, 0.01] as const;
const corners: Place[] = [
  [6, 5.7],
  [7, 5.7],
  [7, 6.3],
  [6, 6.3],
];
const middle: Place = [6.5, 6];

interface Entity {
  id: number;
  label: string;
  polygon: Place[][];
  centroid: Place;
  tags: string[];
  existence: number;
}

/** Queries the server for the objects with a label. */
async function entities(site: Site, label: string, layer = 'objects'): Promise<Entity[]> {
  const question = ['query', 'value', 'office', label, '--layer', layer];
  const lines = await site.hypermap('--json', ...question);
  const answers = lines
    .trim()
    .split('\n')
    .map((line) => JSON.parse(line) as { entity?: Entity });
  return answers.flatMap(({ entity }) => entity ?? []);
}

/** Fills in the form for a new object and starts to draw it. */
async function name(page: Page, label: string, layer = 'objects'): Promise<void> {
  const form = page.getByRole('form', { name: 'New object' });
  await form.getByLabel('Class').fill(label);
  await form.getByLabel('Layer').selectOption(layer);
  await form.getByRole('button', { name: 'Draw' }).click();
}

test('an object is drawn, shown at once, undone and redone', async ({ site, dashboard, page }) => {
  await dashboard.open(site, { layers: ['floor', 'objects'], view });
  const floor = await dashboard.colourAt(middle);
  await dashboard.panel('Edit');
  await name(page, 'trolley');
  await dashboard.draw(corners);

  await expect(page.getByRole('heading', { name: 'Selected: trolley' })).toBeVisible();
  await expect.poll(() => dashboard.colourAt(middle)).not.toBe(floor);
  const [trolley] = await entities(site, 'trolley');
  expect(trolley?.polygon[0]).toHaveLength(5);
  for (const [i, [x, y]] of corners.entries()) {
    expect(trolley?.polygon[0]?.[i]?.[0]).toBeCloseTo(x, 1);
    expect(trolley?.polygon[0]?.[i]?.[1]).toBeCloseTo(y, 1);
  }
  await shot(page, 'edit');

  await page.getByRole('button', { name: 'Undo draw trolley' }).click();
  await expect.poll(() => dashboard.colourAt(middle)).toBe(floor);
  expect(await entities(site, 'trolley')).toEqual([]);

  await page.getByRole('button', { name: 'Redo draw trolley' }).click();
  await expect.poll(() => dashboard.colourAt(middle)).not.toBe(floor);
  expect(await entities(site, 'trolley')).toHaveLength(1);
});

test('an object drawn on a layer with its own frame lies where it was drawn', async ({
  site,
  dashboard,
  page,
}) => {
  await dashboard.open(site, { layers: ['floor', 'dock'], view });
  const floor = await dashboard.colourAt(middle);
  await dashboard.panel('Edit');
  await name(page, 'trolley', 'dock');
  await dashboard.draw(corners);
  await expect(page.getByRole('heading', { name: 'Selected: trolley on dock' })).toBeVisible();
  await expect.poll(() => dashboard.colourAt(middle)).not.toBe(floor);
});

test('a cancelled drawing leaves no object', async ({ site, dashboard, page }) => {
  await dashboard.open(site, { layers: ['floor', 'objects'], view });
  await dashboard.panel('Edit');
  await name(page, 'trolley');
  for (const corner of corners) await dashboard.click(corner);
  await page.keyboard.press('Escape');
  await expect(page.getByText('Click the corners')).toBeHidden();
  expect(await entities(site, 'trolley')).toEqual([]);
});

test('class, shape and pin of an object are changed, and undone with the keyboard', async ({
  site,
  dashboard,
  page,
}) => {
  await dashboard.open(site, { layers: ['floor', 'objects'], view });
  await dashboard.panel('Edit');
  await name(page, 'trolley');
  await dashboard.draw(corners);
  const selected = page.getByRole('region', { name: 'Selected object' });

  await selected.getByLabel('Class').fill('cart');
  await selected.getByRole('button', { name: 'Rename' }).click();
  await expect(page.getByRole('heading', { name: 'Selected: cart' })).toBeVisible();

  await selected.getByRole('button', { name: 'Edit shape' }).click();
  await dashboard.drag([7, 6.3], [7.6, 6.6]);
  await selected.getByRole('button', { name: 'Keep shape' }).click();
  await expect
    .poll(async () =>
      Math.max(...((await entities(site, 'cart'))[0]?.polygon[0] ?? []).map(([x]) => x)),
    )
    .toBeCloseTo(7.6, 1);

  await selected.getByRole('button', { name: 'Pin' }).click();
  await expect(selected.getByRole('button', { name: 'Pinned' })).toBeDisabled();
  expect((await entities(site, 'cart'))[0]?.tags).toEqual(['pinned']);

  await page.getByRole('application', { name: 'Map' }).focus();
  await page.keyboard.press('Delete');
  await expect(page.getByRole('button', { name: 'Undo delete cart' })).toBeVisible();
  expect(await entities(site, 'cart')).toEqual([]);

  // A key is ignored while the previous edit waits for its answer.
  const isNextToUndo = (title: string) =>
    expect(page.getByRole('button', { name: `Undo ${title}` })).toBeEnabled();
  await page.keyboard.press('Control+z');
  await expect(selected.getByRole('button', { name: 'Pinned' })).toBeVisible();
  await isNextToUndo('pin cart');
  await page.keyboard.press('Control+z');
  await expect(selected.getByRole('button', { name: 'Pin', exact: true })).toBeVisible();
  await isNextToUndo('reshape cart');
  await page.keyboard.press('Control+z');
  await expect
    .poll(async () =>
      Math.max(...((await entities(site, 'cart'))[0]?.polygon[0] ?? []).map(([x]) => x)),
    )
    .toBeCloseTo(7, 1);
  await isNextToUndo('rename trolley to cart');
  await page.keyboard.press('Control+z');
  await expect(page.getByRole('heading', { name: 'Selected: trolley' })).toBeVisible();
  await isNextToUndo('draw trolley');
  await page.keyboard.press('Control+z');
  await expect.poll(() => entities(site, 'trolley')).toEqual([]);
  await expect(page.getByRole('button', { name: 'Redo draw trolley' })).toBeEnabled();
  await page.keyboard.press('Control+y');
  await expect.poll(() => entities(site, 'trolley')).toHaveLength(1);
});

test('an object that somebody else has changed in the meantime is not overwritten', async ({
  site,
  dashboard,
  page,
}) => {
  await dashboard.open(site, { layers: ['floor', 'objects'], view });
  await dashboard.panel('Edit');
  await name(page, 'trolley');
  await dashboard.draw(corners);
  const selected = page.getByRole('region', { name: 'Selected object' });
  await selected.getByRole('button', { name: 'Edit shape' }).click();

  // Another client renames the object to hammock and moves it.
  const [trolley] = await entities(site, 'trolley');
  const shape = polygonShape([
    [5, 5.7],
    [5.5, 5.7],
    [5.5, 6.2],
  ]);
  const object = { id: BigInt(trolley?.id ?? 0), label: 'hammock', shape };
  const edit = { case: 'putObject' as const, value: { layer: 'objects', object } };
  await site.client().edit.applyEdits({ map: 'office', edits: [{ edit }] });

  await dashboard.drag([7, 6.3], [7.6, 6.6]);
  await selected.getByRole('button', { name: 'Keep shape' }).click();
  await expect(page.getByRole('alert')).toContainText('Somebody else has changed the object');
  expect((await entities(site, 'hammock'))[0]?.polygon[0]).toHaveLength(4);
  await page.getByRole('button', { name: 'Undo draw trolley' }).click();
  await expect(page.getByRole('alert')).toContainText('Somebody else has changed the object');
  expect(await entities(site, 'hammock')).toHaveLength(1);
});

test('an edit does not extend the lifetime of an object', async ({ site, dashboard, page }) => {
  const shape = polygonShape([
    [6, 5.7],
    [7, 5.7],
    [7, 6.3],
  ]);
  const put = {
    layer: 'objects',
    object: { label: 'trolley', shape },
    timeToLive: { seconds: 600n },
  };
  const edit = { case: 'putObject' as const, value: put };
  await site.client().edit.applyEdits({ map: 'office', edits: [{ edit }] });
  await dashboard.open(site, { layers: ['floor', 'objects'], view });
  await dashboard.click([6.8, 5.8]);
  await page.getByRole('button', { name: 'Pin' }).click();
  await expect(page.getByRole('button', { name: 'Pinned' })).toBeVisible();

  const point = { x: 6.8, y: 5.8 };
  const scope = { map: 'office' };
  const { layers } = await site.client().query.queryPoint({ scope, point });
  const [pinned] = layers.flatMap(({ objects }) => objects);
  const leftMs = Number(pinned?.expireTime?.seconds) * 1000 - Date.now();
  expect(leftMs).toBeGreaterThan(0);
  expect(leftMs).toBeLessThan(601_000);
});

test('a shape that crosses itself is refused, and the page says so', async ({
  site,
  dashboard,
  page,
}) => {
  await dashboard.open(site, { layers: ['floor', 'objects'], view });
  await dashboard.panel('Edit');
  await name(page, 'trolley');
  const [a, b, c, d] = corners as [Place, Place, Place, Place];
  await dashboard.draw([a, c, b, d]);
  await expect(page.getByRole('alert')).toContainText('cross');
  expect(await entities(site, 'trolley')).toEqual([]);
  await expect(page.getByRole('button', { name: 'Undo', exact: true })).toBeDisabled();
});

test('an object that robots found is pinned and deleted for good on its card', async ({
  exploredSite: site,
  dashboard,
  page,
}) => {
  const found = await entities(site, 'chair', 'found');
  const [chair] = found;
  if (!chair) throw new Error('the robots found no chair');
  const [x, y] = chair.centroid;
  await dashboard.open(site, { layers: ['floor', 'found'], view: [x, y, 0.01] });
  await dashboard.click([x, y]);
  const actions = page.getByRole('group', { name: 'Change chair' });
  await actions.getByRole('button', { name: 'Pin' }).click();
  await expect(actions.getByRole('button', { name: 'Pinned' })).toBeVisible();
  const question = { map: 'office', layer: 'found', objectId: BigInt(chair.id) };
  const { events } = await site.client().ingest.explainObject(question);
  expect(events.at(-1)?.kind).toBe(ObjectEventKind.PINNED);

  // A place inside the chair that the mark of the clicked point does not cover.
  const beside: Place = [x + 0.12, y + 0.12];
  const full = await dashboard.colourAt(beside);
  await actions.getByRole('button', { name: 'Delete' }).click();
  await expect.poll(() => dashboard.colourAt(beside)).not.toBe(full);
  // Rebuilding the layer from all observations does not bring the object back.
  await site.client().ingest.rebuildLayer({ map: 'office', layer: 'found' });
  const left = await entities(site, 'chair', 'found');
  expect(left.map(({ id }) => id)).not.toContain(chair.id);
  expect(left).toHaveLength(found.length - 1);
});
