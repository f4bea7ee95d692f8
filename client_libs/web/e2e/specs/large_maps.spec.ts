import type { Page } from '@playwright/test';

import type { Dashboard } from '../support/dashboard.js';
import { polygon, polygonShape } from '../support/edits.js';
import { frameTimes, framesText, panAround, zoomInAndOut } from '../support/frames.js';
import type { Site } from '../support/site.js';
import { expect, shot, test } from '../support/test.js';

// Recording a trace takes screenshots all the time, which slows down the measured frames.
test.use({ trace: 'off' });

async function printFrames(page: Page, what: string): Promise<void> {
  const panned = await frameTimes(page, () => panAround(page));
  const zoomed = await frameTimes(page, () => zoomInAndOut(page));
  console.log(`${what}, panned: ${framesText(panned)}`);
  console.log(`${what}, zoomed: ${framesText(zoomed)}`);
}

/** Waits until two consecutive screenshots are equal and the page is connected. */
async function waitUntilStill(dashboard: Dashboard, page: Page): Promise<void> {
  let last = '';
  await expect
    .poll(async () => {
      const now = (await page.screenshot()).toString('base64');
      const still = now === last;
      last = now;
      return still;
    })
    .toBe(true);
  await dashboard.isLive();
}

const SIDE = 100;

/** Puts 100 x 100 objects of many classes, a metre apart. */
async function putManyObjects(site: Site): Promise<void> {
  await site.hypermap('map', 'create', 'store');
  await site.hypermap('layer', 'create', 'store', 'things', '--kind', 'semantic');
  const edits = Array.from({ length: SIDE * SIDE }, (_, i) => {
    const [x, y] = [i % SIDE, Math.floor(i / SIDE)];
    const corners = 3 + (i % 7);
    const points = Array.from({ length: corners }, (_, k) => {
      const angle = (2 * Math.PI * k) / corners;
      return [x + 0.4 * Math.cos(angle), y + 0.4 * Math.sin(angle)] as const;
    });
    const object = {
      label: `class ${i % 23}`,
      existence: 0.2 + 0.8 * ((i % 11) / 10),
      shape: polygonShape(points),
    };
    return { edit: { case: 'putObject' as const, value: { layer: 'things', object } } };
  });
  await site.client().edit.applyEdits({ map: 'store', edits });
}

/** Moves three objects forty times, as robots would. */
async function moveObjects(site: Site): Promise<void> {
  for (let step = 0; step < 40; step++) {
    const edits = [1n, 2n, 3n].map((id) => {
      const [x, y] = [20 * Number(id) + step / 2, 50 + 10 * Math.sin(step / 8)];
      const shape = polygonShape([
        [x, y],
        [x + 1, y],
        [x + 1, y + 1],
      ]);
      const object = { id, label: 'robot', shape };
      return { edit: { case: 'putObject' as const, value: { layer: 'things', object } } };
    });
    await site.client().edit.applyEdits({ map: 'store', edits });
  }
}

test('10,000 objects are shown at once, and the map moves smoothly', async ({
  emptySite,
  dashboard,
  page,
}) => {
  await putManyObjects(emptySite);
  await dashboard.open(emptySite, { map: 'store' });
  await expect(page.getByRole('region', { name: 'Layers' })).toContainText('10,000');
  await waitUntilStill(dashboard, page);
  await shot(page, 'many_objects');
  const ground = await dashboard.colourAt([50.5, 50.5]);
  expect(await dashboard.colourAt([50, 50])).not.toBe(ground);
  const view = page.url();
  await printFrames(page, '10,000 objects');
  const moved = await frameTimes(page, () => moveObjects(emptySite));
  console.log(`10,000 objects, some of them moving: ${framesText(moved)}`);
  await page.getByRole('button', { name: 'Show all' }).click();
  await expect.poll(() => page.url()).toBe(view);
  await expect.poll(() => dashboard.colourAt([50, 50])).not.toBe(ground);
});

const CELLS = 4000;
const RESOLUTION = 0.05;
const ROOM = 5;

/** Draws a hall of 200 x 200 m with walls every 5 m, in a rotated frame. */
async function drawHall(site: Site): Promise<void> {
  const size = CELLS * RESOLUTION;
  await site.hypermap('map', 'create', 'hall');
  await site.hypermap('transform', 'set', 'hall', 'plan', 'map', '10', '5', '0.3');
  const options = ['--kind', 'occupancy', '--resolution', String(RESOLUTION), '--frame', 'plan'];
  await site.hypermap('layer', 'create', 'hall', 'floor', ...options);
  const fill = (x: number, y: number, width: number, height: number, value: number) => {
    const area = polygon([
      [x, y],
      [x + width, y],
      [x + width, y + height],
      [x, y + height],
    ]);
    return { edit: { case: 'fillPolygon' as const, value: { layer: 'floor', area, value } } };
  };
  const walls = Array.from({ length: size / ROOM }, (_, i) => i * ROOM);
  await site.client().edit.applyEdits({
    map: 'hall',
    edits: [
      fill(0, 0, size, size, 0.05),
      ...walls.map((x) => fill(x, 0, 0.2, size, 1)),
      ...walls.map((y) => fill(0, y, size, 0.2, 1)),
    ],
  });
}

test('a rotated grid of 4,000 x 4,000 cells loads', async ({ emptySite, dashboard, page }) => {
  await drawHall(emptySite);
  const began = Date.now();
  await dashboard.open(emptySite, { map: 'hall' });
  console.log(`4,000 x 4,000 cells: shown after ${Date.now() - began} ms`);
  await waitUntilStill(dashboard, page);
  await shot(page, 'large_grid');
  await printFrames(page, '4,000 x 4,000 cells');
  await waitUntilStill(dashboard, page);

  // The centre of a wall and of a room near the far corner of the hall, in the frame of the map.
  const inMap = (x: number, y: number) =>
    [
      10 + Math.cos(0.3) * x - Math.sin(0.3) * y,
      5 + Math.sin(0.3) * x + Math.cos(0.3) * y,
    ] as const;
  const [wallX, wallY] = inMap(195.1, 192.5);
  await dashboard.open(emptySite, { map: 'hall', view: [wallX, wallY, 0.02] });
  await waitUntilStill(dashboard, page);
  const wall = await dashboard.colourAt([wallX, wallY]);
  const room = await dashboard.colourAt(inMap(193, 192.5));
  const beyond = await dashboard.colourAt(inMap(202, 192.5));
  expect(new Set([wall, room, beyond]).size).toBe(3);
  // A cell is a square of 2.5 pixels, and the wall is 20 cm wide: 8 cm beside its centre is still
  // wall.
  expect(await dashboard.colourAt(inMap(195.18, 192.5))).toBe(wall);
  expect(await dashboard.colourAt(inMap(195.3, 192.5))).toBe(room);
});
