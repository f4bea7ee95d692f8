import { createConnectTransport, createGrpcWebTransport } from '@connectrpc/connect-web';
import { createGrpcTransport } from '@connectrpc/connect-node';
import { Code, type Transport } from '@connectrpc/connect';
import { mkdtemp, rm } from 'node:fs/promises';
import { tmpdir } from 'node:os';
import { join } from 'node:path';
import { afterAll, beforeAll, describe, expect, test } from 'vitest';
import { Server } from '../../e2e/support/programs.js';
import {
  AnswerStatus,
  backupMap,
  ChangeKind,
  createHypermapClient,
  exportMap,
  FileFormat,
  LayerKind,
  newRequestId,
  polygonFromGeoJson,
  shapeFromGeoJson,
  ShapeKind,
  shapeToGeoJson,
  watch,
  type HypermapClient,
  type Polygon,
  type ShapeGeometry,
  type WatchState,
} from './index.js';

let folder: string;
let server: Server;
let gateway: Server;

const serve = (listen: string) =>
  Server.start('hypermapd', [`--data_dir=${folder}`, `--listen=${listen}`]);

beforeAll(async () => {
  folder = await mkdtemp(join(tmpdir(), 'hypermap_client_'));
  // Nobody else takes ports of this address while the server is down.
  server = await serve('127.0.0.11:0');
  gateway = await Server.start('hypermap-gateway', [
    `--server=${server.address}`,
    '--listen=127.0.0.1:0',
    `--dashboard=${folder}`,
  ]);
});

afterAll(async () => {
  await Promise.all([gateway?.stop(), server?.stop()]);
  await rm(folder, { recursive: true, force: true });
});

const square = (x: number, y: number, side = 1) =>
  polygonFromGeoJson({
    type: 'Polygon',
    coordinates: [
      [
        [x, y],
        [x + side, y],
        [x + side, y + side],
        [x, y + side],
      ],
    ],
  });

const polygon = (value: Polygon) => ({ shape: { case: 'polygon' as const, value } });

/** Creates a map with a layer "things" and a chair on it. Returns its name. */
async function drawMap(client: HypermapClient): Promise<string> {
  const map = `map-${newRequestId()}`;
  await client.catalog.createMap({ map });
  await client.catalog.createLayer({ map, layer: { name: 'things', kind: LayerKind.SEMANTIC } });
  await put(client, map, 'chair', 0);
  return map;
}

async function put(client: HypermapClient, map: string, label: string, x: number): Promise<bigint> {
  const { revision } = await client.edit.applyEdits({
    map,
    edits: [
      {
        edit: {
          case: 'putObject',
          value: { layer: 'things', object: { label, shape: polygon(square(x, 0)) } },
        },
      },
    ],
  });
  return revision;
}

const transports: Record<string, () => Transport | string> = {
  'gRPC to the server': () => createGrpcTransport({ baseUrl: `http://${server.address}` }),
  'Connect through the gateway': () =>
    createConnectTransport({ baseUrl: gateway.address, useBinaryFormat: true }),
  'Connect with JSON through the gateway': () =>
    createConnectTransport({ baseUrl: gateway.address }),
  'gRPC-Web through the gateway': () => createGrpcWebTransport({ baseUrl: gateway.address }),
  'the URL of the gateway': () => `${gateway.address}/`,
};

describe.each(Object.entries(transports))('by %s', (_, transport) => {
  test('answers queries by point, area and value', async () => {
    const client = createHypermapClient(transport());
    const scope = { map: await drawMap(client) };

    const at = await client.query.queryPoint({ scope, point: { x: 0.5, y: 0.5 } });
    expect(at.layers[0]?.status).toBe(AnswerStatus.VALUE);
    expect(at.layers[0]?.objects.map(({ label }) => label)).toEqual(['chair']);

    const inside = [];
    for await (const { part } of client.query.queryArea({ scope, area: square(0.5, 0.5) })) {
      inside.push(...(part?.objects ?? []));
    }
    expect(inside.map(({ label }) => label)).toEqual(['chair']);

    const found = [];
    for await (const { part } of client.query.queryValue({ scope, value: 'chair' })) {
      found.push(...(part?.objects ?? []));
    }
    expect(found).toEqual(inside);
    expect(found[0]?.centroid).toMatchObject({ x: 0.5, y: 0.5 });
  });

  test('a line string and a point are found within a tolerance', async () => {
    const client = createHypermapClient(transport());
    const map = `map-${newRequestId()}`;
    await client.catalog.createMap({ map });
    const lane: ShapeGeometry = {
      type: 'LineString',
      coordinates: [
        [0, 0],
        [4, 0],
        [4, 3],
      ],
    };
    const dock: ShapeGeometry = { type: 'Point', coordinates: [2, 0.5] };
    const layer = {
      name: 'ways',
      kind: LayerKind.SEMANTIC,
      shapeKinds: [ShapeKind.LINE_STRING, ShapeKind.POINT],
    };
    const put = (label: string, geometry: ShapeGeometry) => {
      const object = { label, shape: shapeFromGeoJson(geometry) };
      return { edit: { case: 'putObject' as const, value: { layer: layer.name, object } } };
    };
    const edits = [put('lane', lane), put('dock', dock)];
    await client.edit.applyEdits({
      map,
      edits: [{ edit: { case: 'createLayer', value: { layer } } }, ...edits],
    });

    const found = async (toleranceM: number) => {
      const point = { x: 2, y: 0.25 };
      const { layers } = await client.query.queryPoint({ scope: { map }, point, toleranceM });
      return layers.flatMap(({ objects }) => objects);
    };
    expect(await found(0)).toEqual([]);
    const objects = await found(0.3);
    expect(objects.map(({ label }) => label)).toEqual(['lane', 'dock']);
    expect(objects.map(({ shape }) => shape && shapeToGeoJson(shape))).toEqual([lane, dock]);
    const told = await client.catalog.getLayer({ map, layer: layer.name });
    expect(told.layer?.shapeKinds).toEqual(layer.shapeKinds);
    expect(told.layer?.properties).toMatchObject({ hasShapes: true, hasCells: false });
  });

  test('errors have the code and message of the server', async () => {
    const client = createHypermapClient(transport());
    await expect(client.catalog.getMap({ map: 'nowhere' })).rejects.toMatchObject({
      code: Code.NotFound,
      rawMessage: expect.stringContaining('nowhere'),
    });
    const answers = client.query.queryValue({ scope: { map: 'nowhere' }, value: 'chair' });
    await expect(answers[Symbol.asyncIterator]().next()).rejects.toMatchObject({
      code: Code.NotFound,
    });
  });

  test('a mutation that is repeated with its request id changes the map once', async () => {
    const client = createHypermapClient(transport());
    const map = await drawMap(client);
    const edit = {
      map,
      requestId: newRequestId(),
      edits: [
        {
          edit: {
            case: 'putObject' as const,
            value: { layer: 'things', object: { label: 'table', shape: polygon(square(5, 5)) } },
          },
        },
      ],
    };
    const first = await client.edit.applyEdits(edit);
    expect(await client.edit.applyEdits(edit)).toEqual(first);
    expect((await client.catalog.getLayer({ map, layer: 'things' })).layer?.size).toBe(2n);
  });

  test('a watch reports changes at once, and resumes with those that were missed', async () => {
    const client = createHypermapClient(transport());
    const map = await drawMap(client);
    const labels: string[] = [];
    let last = 0n;
    for await (const event of watch(client, { scope: { map } })) {
      last = event.revision;
      for (const { kind, object } of event.changes) {
        if (kind === ChangeKind.PUT) labels.push(object?.label ?? '');
      }
      if (labels.length === 1) await put(client, map, 'couch', 2);
      if (labels.length === 2) break;
    }
    expect(labels).toEqual(['chair', 'couch']);

    await put(client, map, 'plant', 4);
    for await (const event of watch(client, { scope: { map }, startRevision: last })) {
      labels.push(...event.changes.map(({ object }) => object?.label ?? ''));
      if (event.changes.length > 0) break;
    }
    expect(labels).toEqual(['chair', 'couch', 'plant']);
  });

  test('C5 a map that is made again under its name begins a watch anew', async () => {
    const client = createHypermapClient(transport());
    const map = await drawMap(client);
    const old = (await client.catalog.getMap({ map })).map?.incarnation;
    if (!old) throw new Error('the map has no incarnation');
    let last = 0n;
    for await (const event of watch(client, { scope: { map } })) {
      expect(event.incarnation).toBe(old);
      last = event.revision;
      if (event.complete) break;
    }

    await client.catalog.deleteMap({ map, incarnation: old });
    const made = (await client.catalog.createMap({ map })).map?.incarnation;
    expect(made).not.toBe(old);
    await client.catalog.createLayer({ map, layer: { name: 'things', kind: LayerKind.SEMANTIC } });
    // The number of the revision alone would let the watch continue.
    expect(await put(client, map, 'plant', 4)).toBe(last);
    await expect(client.catalog.deleteMap({ map, incarnation: old })).rejects.toMatchObject({
      code: Code.Aborted,
    });
    const scope = { map, incarnation: old };
    for await (const event of watch(client, { scope, startRevision: last })) {
      expect(event).toMatchObject({ incarnation: made, snapshot: true, reset: true });
      expect(event.changes.map(({ object }) => object?.label)).toEqual(['plant']);
      break;
    }
    expect(await exportMap(client, { map, format: FileFormat.GEOJSON })).toMatchObject({
      revision: last,
      incarnation: made,
    });
  });

  test('exports and backups are complete', async () => {
    const client = createHypermapClient(transport());
    const map = await drawMap(client);
    const { files, revision } = await exportMap(client, { map, format: FileFormat.GEOJSON });
    expect(revision).toBeGreaterThan(0n);
    expect(await Promise.all(files.map(({ data }) => data.text()))).toEqual([
      expect.stringContaining('chair'),
    ]);
    const copy = await backupMap(client, map);
    expect(copy.name).toBe(`${map}.gpkg`);
    expect(await copy.data.slice(0, 15).text()).toBe('SQLite format 3');
  });
});

test('a watch resumes after a server restart without gaps or repetitions', async () => {
  const client = createHypermapClient(gateway.address);
  const map = await drawMap(client);
  const states: WatchState[] = [];
  const revisions: bigint[] = [];
  let disconnected: () => void;
  const broken = new Promise<void>((resolve) => (disconnected = resolve));
  const onState = (state: WatchState) => {
    states.push(state);
    if (state === 'disconnected') disconnected();
  };
  const following = (async () => {
    const backoff = { firstMs: 20, longestMs: 50 };
    for await (const event of watch(
      client,
      { scope: { map }, startRevision: 0n },
      { onState, backoff },
    )) {
      if (event.changes.length > 0) revisions.push(event.revision);
      if (event.revision === 6n) return;
    }
  })();
  for (let revision = 2n; revision < 4n;) revision = await put(client, map, 'before', 2);

  await server.stop('SIGKILL');
  await broken;
  const edited = put(createHypermapClient(gateway.address, { retries: 20 }), map, 'after', 3);
  server = await serve(server.address);
  expect(await edited).toBe(5n);
  await put(client, map, 'after', 4);

  await following;
  expect(revisions).toEqual([1n, 2n, 3n, 4n, 5n, 6n]);
  expect(states.at(-1)).toBe('live');
  expect(states.filter((state) => state === 'live')).toHaveLength(2);
});
