import { LayerKind, shapeFromGeoJson, type ShapeGeometry } from '@hypermap/client';
import type { Page } from '@playwright/test';
import { existsSync } from 'node:fs';

import { cellsOfAnswer, cellsOfMessage, contentOf, differences } from '../support/content.js';
import { deleteObject, fillSquare, putSquare } from '../support/edits.js';
import {
  buildViewer,
  openViewer,
  received,
  receivedTopics,
  serveViewer,
  sketchesOfAnswer,
  sketchesOfMessage,
  type ViewerOptions,
} from '../support/foxglove.js';
import { dataFolder } from '../support/places.js';
import type { Site } from '../support/site.js';
import { expect, shot, test } from '../support/test.js';

test.beforeAll(buildViewer);

function putWay(label: string, geometry: ShapeGeometry) {
  const object = { label, existence: 1, shape: shapeFromGeoJson(geometry) };
  return { edit: { case: 'putObject' as const, value: { layer: 'ways', object } } };
}

/** Changes the office: objects and cells, a layer of lines and points, and a frame. */
async function editOffice(site: Site): Promise<void> {
  const layer = { name: 'ways', kind: LayerKind.SEMANTIC };
  await site.client().edit.applyEdits({
    map: 'office',
    edits: [
      { edit: { case: 'createLayer', value: { layer } } },
      putWay('lane', {
        type: 'LineString',
        coordinates: [
          [1, 6],
          [9, 6],
          [9, 5],
        ],
      }),
      putWay('charger', { type: 'Point', coordinates: [1, 6.5] }),
    ],
  });
  await site.hypermap('transform', 'set', 'office', 'shelf', 'dock', '1', '2', '0.5');
  await putSquare(site, 'objects', 'trolley', [6, 5.5]);
  const lost = await putSquare(site, 'objects', 'lost', [7, 5.5]);
  await fillSquare(site, 'floor', [11, 5.5], 1);
  await deleteObject(site, 'objects', lost);
}

/** Shows a map in a viewer, whose picture is saved under a name. */
async function showMap(
  page: Page,
  site: Site,
  options: ViewerOptions,
  name: string,
): Promise<void> {
  const gateway = await serveViewer(site);
  try {
    await openViewer(page, gateway, options);
    await expectMap(page, site, options.map);
    await shot(page, name);
  } finally {
    await gateway.stop();
  }
}

/** Compares what the viewer receives with the answers of the server: cells, objects and frames. */
async function expectMap(page: Page, site: Site, map: string): Promise<void> {
  const client = site.client();
  const { layers } = await client.catalog.listLayers({ map });
  const [grids = [], scenes = []] = [true, false].map((hasCells) =>
    layers.filter(({ properties }) => properties?.hasCells === hasCells).map(({ name }) => name),
  );
  await expect
    .poll(() => receivedTopics(page))
    .toEqual({
      topics: [
        ...grids.map((name) => `/grids/${name}`),
        ...scenes.map((name) => `/objects/${name}`),
        '/transforms',
      ],
      problems: [],
    });

  const now = await received(page);
  for (const layer of grids) {
    const message = now.grids[`/grids/${layer}`];
    const shown = message ? cellsOfMessage(message) : new Map<string, number>();
    const expected = cellsOfAnswer(await contentOf(client, map, layer));
    expect(shown.size, layer).toBeGreaterThan(0);
    expect(differences(shown, expected), layer).toEqual([]);
  }
  for (const layer of scenes) {
    const message = now.scenes[`/objects/${layer}`];
    const expected = sketchesOfAnswer(await contentOf(client, map, layer));
    expect(message && sketchesOfMessage(message), layer).toEqual(expected);
  }
  const { transforms } = await client.catalog.listTransforms({ map });
  expect(now.transforms?.transforms).toMatchObject(
    transforms.map(({ parentFrameId, childFrameId, parentFromChild }) => ({
      parent_frame_id: parentFrameId,
      child_frame_id: childFrameId,
      translation: { x: parentFromChild?.x, y: parentFromChild?.y },
    })),
  );
}

for (const subprotocol of ['foxglove.websocket.v1', 'foxglove.sdk.v1']) {
  test(`a client of ${subprotocol} that comes late gets the edited office`, async ({
    site,
    page,
  }) => {
    await editOffice(site);
    const options = { map: 'office', subprotocol, hidden: ['/grids/wifi'] };
    await showMap(page, site, options, 'foxglove-late');
  });
}

test('a client of Foxglove gets a recorded map', async ({ emptySite: site, page }) => {
  const file = `${dataFolder}/maps/map_floor_t1.hmap`;
  test.skip(!existsSync(file), 'the recorded maps are missing');
  await site.hypermap('import', file, '--map', 'recorded');
  const options = { map: 'recorded', subprotocol: 'foxglove.sdk.v1' };
  await showMap(page, site, options, 'foxglove-recorded');
});
