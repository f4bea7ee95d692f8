import { shapeFromGeoJson } from '@hypermap/client';
import type { Page } from '@playwright/test';
import { readFile } from 'node:fs/promises';

import type { Place } from '../support/dashboard.js';
import { root } from '../support/places.js';
import type { Site } from '../support/site.js';
import { expect, shot, test } from '../support/test.js';

/** The pose of the office in the attic, a map of the same objects and walls. */
const TURNED = { x: 3, y: 1, yaw: 0.5 };

interface Feature {
  properties: { label: string };
  geometry: Parameters<typeof shapeFromGeoJson>[0];
}

/** Creates the attic: its objects are those of the office turned, its floor is the same one. */
async function drawAttic(site: Site): Promise<void> {
  const { x, y, yaw } = TURNED;
  await site.hypermap('map', 'create', 'attic');
  const cells = ['--kind', 'occupancy', '--resolution', '0.05'];
  await site.hypermap('layer', 'create', 'attic', 'floor', ...cells);
  await site.hypermap('layer', 'create', 'attic', 'objects', '--kind', 'semantic');
  await site.hypermap('edit', 'attic', `${root}demo/office/floor.geojson`, '--layer', 'floor');
  await site.hypermap('transform', 'set', 'attic', 'turned', 'map', `${x}`, `${y}`, `${yaw}`);
  const text = await readFile(`${root}demo/office/objects.geojson`, 'utf8');
  const { features } = JSON.parse(text) as { features: Feature[] };
  const edits = features.map(({ properties: { label }, geometry }) => {
    const object = { label, existence: 1, shape: shapeFromGeoJson(geometry) };
    const value = { layer: 'objects', frameId: 'turned', object };
    return { edit: { case: 'putObject' as const, value } };
  });
  await site.client().edit.applyEdits({ map: 'attic', edits });
}

/** The frames that were set in the office besides the one of its dock. */
async function frames(site: Site) {
  const { transforms } = await site.client().catalog.listTransforms({ map: 'office' });
  return transforms.filter(({ childFrameId }) => childFrameId !== 'dock');
}

async function chooseAttic(page: Page, layer: string) {
  const panel = page.getByRole('region', { name: 'Align', exact: true });
  await panel.getByLabel('Map to lay over office').selectOption('attic');
  await panel.getByLabel('Layer of attic').selectOption(layer);
  await expect(panel.getByText('attic over the shown map')).toBeVisible();
  return panel;
}

test('another map is compared with the shown one, drawn over it, and its frame is set', async ({
  site,
  dashboard,
  page,
}) => {
  await drawAttic(site);
  await dashboard.open(site);
  await dashboard.panel('Align');
  const panel = await chooseAttic(page, 'objects');
  await expect(panel.getByLabel('Layer of office')).toHaveValue('objects');
  await panel.getByRole('button', { name: 'Estimate', exact: true }).click();
  const best = panel.getByRole('row', { name: 'Best' }).getByRole('cell');
  await expect(best.nth(2)).toHaveText('-28.65°');
  // The inverse of TURNED.
  const [cos, sin] = [Math.cos(TURNED.yaw), Math.sin(TURNED.yaw)];
  const x = -cos * TURNED.x - sin * TURNED.y;
  const y = sin * TURNED.x - cos * TURNED.y;
  expect(Number(await best.nth(0).textContent())).toBeCloseTo(x, 2);
  expect(Number(await best.nth(1).textContent())).toBeCloseTo(y, 2);
  await expect(panel.getByText('Not ambiguous.')).toBeVisible();
  await shot(page, 'align');

  expect(await frames(site)).toEqual([]);
  await panel.getByRole('button', { name: 'Apply' }).click();
  await expect(panel.getByText('Frame attic is set in map')).toBeVisible();
  const [frame] = await frames(site);
  expect(frame).toMatchObject({ childFrameId: 'attic', parentFrameId: 'map' });
  expect(frame?.parentFromChild?.yaw).toBeCloseTo(-TURNED.yaw, 3);
});

test('pairs of places are clicked, listed with residuals, and estimated from', async ({
  site,
  dashboard,
  page,
}) => {
  // Free floor, on which the attic's west wall lies after it has been moved by a metre.
  const moved: Place = [1.1, 3];
  const clickPair = async (from: Place, to: Place) => {
    await expect(page.getByText('click a place of attic')).toBeVisible();
    await dashboard.click(from);
    await expect(page.getByText('click where it belongs in office')).toBeVisible();
    await dashboard.click(to);
  };
  await drawAttic(site);
  await dashboard.open(site, { layers: ['floor'], view: [5, 6, 0.02] });
  const floor = await dashboard.colourAt(moved);
  await dashboard.panel('Align');
  const panel = await chooseAttic(page, 'floor');
  const estimate = panel.getByRole('button', { name: 'Estimate from pairs' });
  await expect(estimate).toBeDisabled();

  // These two contradict each other.
  await panel.getByRole('button', { name: 'Add pairs' }).click();
  await clickPair([4, 4], [5, 4]);
  await clickPair([6, 8], [4, 5]);
  await panel.getByRole('button', { name: 'Done' }).click();
  const rows = panel.getByRole('list', { name: 'Pairs' }).getByRole('listitem');
  await expect(rows).toHaveCount(2);
  await estimate.click();
  await expect(panel.getByText('Ambiguous: ')).toBeVisible();
  await expect(rows.nth(1)).toContainText('does not agree');
  const apply = panel.getByRole('button', { name: 'Apply' });
  await expect(apply).toBeDisabled();
  await panel.getByLabel('Apply all the same').check();
  await expect(apply).toBeEnabled();

  await panel.getByRole('button', { name: 'Remove pair 2' }).click();
  await expect(rows).toHaveCount(1);
  await panel.getByRole('button', { name: 'Add pairs' }).click();
  await clickPair([6, 8], [7, 8]);
  await clickPair([4, 8], [5, 8]);
  await panel.getByRole('button', { name: 'Done' }).click();
  await estimate.click();
  await expect(panel.getByText('Not ambiguous.')).toBeVisible();
  await expect(rows.nth(2)).toContainText(/0\.0\d m/);
  await expect.poll(() => dashboard.colourAt(moved)).not.toBe(floor);
  await shot(page, 'align_pairs');

  await apply.click();
  await expect(panel.getByText('Frame attic is set in map')).toBeVisible();
  const [frame] = await frames(site);
  expect(frame?.parentFromChild?.x).toBeCloseTo(1, 1);
  expect(frame?.parentFromChild?.y).toBeCloseTo(0, 1);
  await page.getByRole('button', { name: 'Close Align' }).click();
  await expect.poll(() => dashboard.colourAt(moved)).toBe(floor);
});
