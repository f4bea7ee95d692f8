import { PNG } from 'pngjs';

import { Dashboard, type Place } from '../support/dashboard.js';
import { deleteObject, fillSquare, putSquare } from '../support/edits.js';
import { expect, shot, test } from '../support/test.js';

// The lower left corners of two squares of half a metre on free floor of the corridor, and their
// centres.
const CORNERS: readonly [Place, Place] = [
  [2.75, 5.65],
  [4.75, 5.65],
];
const [HERE, THERE]: readonly [Place, Place] = [
  [3, 5.9],
  [5, 5.9],
];

test('shows the office live', async ({ site, dashboard, page }) => {
  await dashboard.open(site);
  await shot(page, 'map_live');
  await expect(page).toHaveTitle(/office/);
});

test('an object that another client puts, moves and deletes is shown accordingly', async ({
  site,
  dashboard,
}) => {
  await dashboard.open(site);
  const empty = await dashboard.colourAt(HERE);

  const id = await putSquare(site, 'objects', 'trolley', CORNERS[0]);
  await expect.poll(() => dashboard.colourAt(HERE)).not.toBe(empty);
  const full = await dashboard.colourAt(HERE);

  await putSquare(site, 'objects', 'trolley', CORNERS[1], id);
  await expect.poll(() => dashboard.colourAt(HERE)).toBe(empty);
  await expect.poll(() => dashboard.colourAt(THERE)).toBe(full);

  await deleteObject(site, 'objects', id);
  await expect.poll(() => dashboard.colourAt(THERE)).toBe(empty);
});

test('objects with a lower existence are fainter', async ({ site, dashboard }) => {
  await dashboard.open(site);
  const channels = async (place: Place) => (await dashboard.colourAt(place)).split(',').map(Number);
  const empty = await channels(HERE);
  // The distance of a place's colour from that of empty floor.
  const strength = async (place: Place) =>
    Math.hypot(...(await channels(place)).map((value, i) => value - (empty[i] ?? NaN)));

  await putSquare(site, 'objects', 'trolley', CORNERS[0], 0n, 1);
  await putSquare(site, 'objects', 'trolley', CORNERS[1], 0n, 0.2);
  await expect.poll(() => strength(THERE)).toBeGreaterThan(0);
  expect(await strength(THERE)).toBeLessThan(0.7 * (await strength(HERE)));
});

test('cells that another client writes are repainted', async ({ site, dashboard }) => {
  await dashboard.open(site, { layers: ['floor'] });
  const free = await dashboard.colourAt(HERE);
  await fillSquare(site, 'floor', CORNERS[0], 1);
  await expect.poll(() => dashboard.colourAt(HERE)).not.toBe(free);
  await fillSquare(site, 'floor', CORNERS[0], 0.02);
  await expect.poll(() => dashboard.colourAt(HERE)).toBe(free);
});

test('moving a frame moves its layers', async ({ site, dashboard }) => {
  await dashboard.open(site, { layers: ['dock'], view: [20, 6, 0.03] });
  const truck = [21.5, 7.2] as const;
  const before = await dashboard.colourAt(truck);
  await site.hypermap('transform', 'set', 'office', 'dock', 'map', '60', '0', '1.75');
  await expect.poll(() => dashboard.colourAt(truck)).not.toBe(before);
  await site.hypermap('transform', 'set', 'office', 'dock', 'map', '20', '0', '1.75');
  await expect.poll(() => dashboard.colourAt(truck)).toBe(before);
});

test('a layer that another client deletes disappears', async ({ site, dashboard, page }) => {
  await dashboard.open(site, { view: [20, 6, 0.03] });
  const truck = [21.5, 7.2] as const;
  const before = await dashboard.colourAt(truck);
  await site.hypermap('layer', 'delete', 'office', 'dock');
  await expect(page.getByRole('checkbox', { name: 'dock' })).toBeHidden();
  await expect.poll(() => dashboard.colourAt(truck)).not.toBe(before);
});

test('zoom steps that follow each other at once add up', async ({ site, dashboard, page }) => {
  await dashboard.open(site, { view: [10, 6, 0.06] });
  // All clicks come in one turn of the page, before the first step has painted anything.
  const click = (names: string[]) =>
    page.evaluate((all) => {
      for (const name of all) {
        document.querySelector<HTMLElement>(`button[aria-label="${name}"]`)?.click();
      }
    }, names);
  await click(['Zoom in', 'Zoom out', 'Zoom out']);
  await expect.poll(() => page.url()).toMatch(/,0\.12$/);
  await click(['Zoom in', 'Zoom in']);
  await expect.poll(() => page.url()).toMatch(/,0\.03$/);
  await click(['Zoom out']);
  await expect.poll(() => page.url()).toMatch(/view=10,6,0\.06$/);
});

/** Counts the pixels of two pictures that differ visibly. */
function differences(a: Buffer, b: Buffer): number {
  const [one, other] = [PNG.sync.read(a).data, PNG.sync.read(b).data];
  let count = 0;
  for (let i = 0; i < one.length; i += 4) {
    const differs = [0, 1, 2].some((c) => Math.abs((one[i + c] ?? 0) - (other[i + c] ?? 0)) > 8);
    if (differs) count++;
  }
  return count;
}

test('a map updated change by change looks like the same map loaded at once', async ({
  site,
  dashboard,
  page,
  context,
}) => {
  // The view is too coarse for labels, whose placement depends on the order in which they were
  // added.
  await dashboard.open(site, { layers: ['floor', 'objects'], view: [10, 6, 0.06] });
  const url = page.url();
  // The part of the screen between the panels.
  const clip = { x: 320, y: 70, width: 980, height: 730 };
  const ids: bigint[] = [];
  for (let i = 0; i < 24; i++) {
    const corner = [1.3 + ((i * 7.3) % 17), 0.7 + ((i * 3.1) % 10)] as const;
    if (i % 4 === 3) await deleteObject(site, 'objects', ids.shift() ?? 0n);
    else if (i % 4 === 2) await fillSquare(site, 'floor', corner, (i % 3) / 2);
    else if (i % 8 === 5) await putSquare(site, 'objects', `class ${i}`, corner, ids[0]);
    else ids.push(await putSquare(site, 'objects', `class ${i}`, corner, 0n, (i % 5) / 4));
    // Some changes arrive while the map is being zoomed, and the second step during the first.
    if (i === 12) await page.getByRole('button', { name: 'Zoom in' }).click();
    if (i === 14) await page.getByRole('button', { name: 'Zoom out' }).click();
  }
  // The last change moves an object far away, so that both its old and its new place must be
  // repainted.
  const empty = await dashboard.colourAt(HERE);
  const id = await putSquare(site, 'objects', 'class 5', CORNERS[0]);
  await expect.poll(() => dashboard.colourAt(HERE)).not.toBe(empty);
  await putSquare(site, 'objects', 'class 5', [18, 5.65], id);
  await expect.poll(() => page.url()).toBe(url);

  const fresh = new Dashboard(await context.newPage());
  await fresh.page.goto(url);
  await fresh.isLive();
  await expect
    .poll(async () =>
      differences(await page.screenshot({ clip }), await fresh.page.screenshot({ clip })),
    )
    .toBeLessThan(10);
});
