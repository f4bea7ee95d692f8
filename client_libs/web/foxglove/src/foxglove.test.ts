import { createGrpcTransport } from '@connectrpc/connect-node';
import * as schemas from '@foxglove/schemas/jsonschema';
import { FoxgloveClient, type Channel, type MessageData } from '@foxglove/ws-protocol';
import { createHypermapClient, LayerKind, type HypermapClient } from '@hypermap/client';
import Ajv from 'ajv';
import { mkdtemp, rm } from 'node:fs/promises';
import { tmpdir } from 'node:os';
import { join } from 'node:path';
import { afterAll, beforeAll, expect, test } from 'vitest';
import WebSocket from 'ws';
import { binaryRamp, classColour, colourAt, floorRamp } from '../../dashboard/src/map/colours.js';
import {
  cellsOfAnswer,
  cellsOfMessage,
  contentOf,
  differences,
  type GridMessage,
} from '../../e2e/support/content.js';
import { root } from '../../e2e/support/places.js';
import { run, Server } from '../../e2e/support/programs.js';

let folder: string;
let server: Server;
let gateway: Server;
let client: HypermapClient;

/** Makes the map of the demo's office, with layers of every kind, one of them in its own frame. */
async function makeOffice(): Promise<void> {
  const hypermap = (...args: string[]) => run('hypermap', ['--server', server.address, ...args]);
  await hypermap('map', 'create', 'office');
  await hypermap('transform', 'set', 'office', 'dock', 'map', '20', '0', '1.75');
  const layers: [string, ...string[]][] = [
    ['floor', '--kind', 'occupancy', '--resolution', '0.05'],
    ['seen', '--kind', 'exploration', '--resolution', '0.1'],
    ['wifi', '--kind', 'scalar', '--unit', 'dBm', '--resolution', '0.25'],
    ['objects', '--kind', 'semantic'],
    ['dock', '--kind', 'semantic', '--frame', 'dock'],
  ];
  for (const [name, ...options] of layers) {
    await hypermap('layer', 'create', 'office', name, ...options);
    await hypermap('edit', 'office', `${root}demo/office/${name}.geojson`, '--layer', name);
  }
}

const serve = (listen: string) =>
  Server.start('hypermapd', [`--data_dir=${folder}`, `--listen=${listen}`]);

beforeAll(async () => {
  folder = await mkdtemp(join(tmpdir(), 'hypermap_foxglove_'));
  // Nobody else takes ports of this address while the server is down.
  server = await serve('127.0.0.12:0');
  gateway = await Server.start('hypermap-gateway', [
    `--server=${server.address}`,
    '--listen=127.0.0.1:0',
    `--dashboard=${folder}`,
  ]);
  client = createHypermapClient(createGrpcTransport({ baseUrl: `http://${server.address}` }));
  await makeOffice();
});

afterAll(async () => {
  await Promise.all([gateway?.stop(), server?.stop()]);
  await rm(folder, { recursive: true, force: true });
});

interface Vector {
  x: number;
  y: number;
}

interface Entity {
  id: string;
  lines: { type: number; points: Vector[]; color: { r: number; g: number; b: number } }[];
  triangles: { indices: number[] }[];
  spheres: { pose: { position: Vector } }[];
  texts: { text: string }[];
}

interface Scene {
  entities: Entity[];
}

/** A connection of Foxglove's own client to the map. */
class Viewer {
  readonly #client: FoxgloveClient;
  readonly #channels = new Map<string, Channel>();
  readonly #waiting = new Set<() => void>();
  readonly #newest = new Map<number, unknown>();

  constructor(subprotocol: string) {
    const url = `${gateway.address.replace('http', 'ws')}/foxglove/office`;
    this.#client = new FoxgloveClient({ ws: new WebSocket(url, [subprotocol]) });
    this.#client.on('advertise', (channels) => {
      for (const channel of channels) this.#channels.set(channel.topic, channel);
      this.#wake();
    });
    this.#client.on('message', ({ subscriptionId, data }: MessageData) => {
      this.#newest.set(subscriptionId, JSON.parse(new TextDecoder().decode(data)));
      this.#wake();
    });
  }

  close(): void {
    this.#client.close();
  }

  /** Shows a revision, 0 for the newest. */
  show(revision: number): void {
    this.#client.setParameters([{ name: 'as_of_revision', value: revision }]);
  }

  async topics(count: number): Promise<string[]> {
    await this.#until(() => this.#channels.size >= count);
    return [...this.#channels.keys()].sort();
  }

  async channel(topic: string): Promise<Channel> {
    return this.#until(() => this.#channels.get(topic));
  }

  /** Subscribes to a topic. Returns a function that waits for content which is as wanted. */
  async subscribe<T>(topic: string): Promise<(isWanted?: (content: T) => boolean) => Promise<T>> {
    const subscription = this.#client.subscribe((await this.channel(topic)).id);
    return async (isWanted = () => true) =>
      this.#until(() => {
        const content = this.#newest.get(subscription) as T | undefined;
        return content !== undefined && isWanted(content) ? content : undefined;
      });
  }

  async #until<T>(find: () => T | undefined): Promise<T> {
    for (;;) {
      const found = find();
      if (found) return found;
      await new Promise<void>((resolve) => this.#waiting.add(resolve));
    }
  }

  #wake(): void {
    for (const resolve of this.#waiting) resolve();
    this.#waiting.clear();
  }
}

/** Puts a mug on the layer "objects". */
async function putMug(): Promise<void> {
  const object = {
    label: 'mug',
    shape: { shape: { case: 'point' as const, value: { x: 1, y: 2 } } },
  };
  const edit = { case: 'putObject' as const, value: { layer: 'objects', object } };
  await client.edit.applyEdits({ map: 'office', edits: [{ edit }] });
}

const ajv = new Ajv({ strict: false, formats: { time: true, duration: true } });

function expectToMatch(schema: object, content: unknown): void {
  const validate = ajv.compile({ ...schema, $comment: undefined, additionalProperties: false });
  expect(validate(content), JSON.stringify(validate.errors)).toBe(true);
}

test('each layer is a channel with the schema of its content', async () => {
  const viewer = new Viewer('foxglove.websocket.v1');
  expect(await viewer.topics(6)).toEqual([
    '/grids/floor',
    '/grids/seen',
    '/grids/wifi',
    '/objects/dock',
    '/objects/objects',
    '/transforms',
  ]);
  const grid = await viewer.channel('/grids/floor');
  expect(grid).toMatchObject({
    encoding: 'json',
    schemaName: 'foxglove.Grid',
    schemaEncoding: 'jsonschema',
  });
  expect(JSON.parse(grid.schema)).toEqual(schemas.Grid);
  viewer.close();
});

test.each(['floor', 'seen', 'wifi'])('the cells of %s are those of the server', async (layer) => {
  const viewer = new Viewer('foxglove.sdk.v1');
  const grid = await (await viewer.subscribe<GridMessage>(`/grids/${layer}`))();
  expectToMatch(schemas.Grid, grid);
  expect(Buffer.from(grid.data, 'base64').length % grid.row_stride).toBe(0);
  const content = await contentOf(client, 'office', layer);
  const resolution = content[0]?.cells?.grid?.resolutionM;
  expect(grid.cell_size).toEqual({ x: resolution, y: resolution });
  const shown = cellsOfMessage(grid);
  expect(shown.size).toBeGreaterThan(100);
  expect(differences(shown, cellsOfAnswer(content))).toEqual([]);
  viewer.close();
});

test('cells have the colours of the dashboard', async () => {
  const viewer = new Viewer('foxglove.sdk.v1');
  const ramps = { floor: floorRamp(false), seen: binaryRamp(false) };
  for (const [layer, ramp] of Object.entries(ramps)) {
    const grid = await (await viewer.subscribe<GridMessage>(`/grids/${layer}`))();
    const data = Buffer.from(grid.data, 'base64');
    const shown = new Map<number, number[]>();
    for (let at = 0; at < data.length; at += grid.cell_stride) {
      shown.set(data.readFloatLE(at), [...data.subarray(at + 4, at + 8)]);
    }
    expect(shown.size).toBeGreaterThan(1);
    for (const [value, colour] of shown) {
      expect(colour).toEqual(Number.isNaN(value) ? [0, 0, 0, 0] : colourAt(ramp, value));
    }
  }
  viewer.close();
});

test.each(['objects', 'dock'])('the objects of %s are those of the server', async (layer) => {
  const viewer = new Viewer('foxglove.sdk.v1');
  const { entities } = await (await viewer.subscribe<Scene>(`/objects/${layer}`))();
  expectToMatch(schemas.SceneUpdate, { deletions: [], entities });
  const objects = (await contentOf(client, 'office', layer)).flatMap((part) => part.objects);
  expect(entities.map(({ id }) => id)).toEqual(objects.map(({ id }) => String(id)));
  for (const [i, { label, shape }] of objects.entries()) {
    const entity = entities[i];
    expect(entity?.texts.map(({ text }) => text)).toEqual([label]);
    if (shape?.shape.case !== 'polygon') continue;
    const outer = shape.shape.value.outer;
    const points = outer?.xs.map((x, at) => ({ x, y: outer.ys[at], z: 0 }));
    expect(entity?.lines[0]?.points).toEqual(points);
    if (shape.shape.value.holes.length === 0) expect(entity?.triangles).toHaveLength(1);
    const { r = 0, g = 0, b = 0 } = entity?.lines[0]?.color ?? {};
    expect([r, g, b].map((part) => Math.round(255 * part))).toEqual(classColour(label, false));
  }
  viewer.close();
});

test('the frame tree is that of the server', async () => {
  const viewer = new Viewer('foxglove.sdk.v1');
  const shown = await (await viewer.subscribe('/transforms'))();
  expectToMatch(schemas.FrameTransforms, shown);
  const { transforms } = await client.catalog.listTransforms({ map: 'office' });
  expect(shown).toMatchObject({
    transforms: transforms.map(({ parentFrameId, childFrameId, parentFromChild }) => ({
      parent_frame_id: parentFrameId,
      child_frame_id: childFrameId,
      translation: { x: parentFromChild?.x, y: parentFromChild?.y, z: 0 },
      rotation: { z: Math.sin((parentFromChild?.yaw ?? 0) / 2) },
    })),
  });
  viewer.close();
});

test('goals of an exploration appear, and the past is without them', async () => {
  const before = Number((await client.catalog.getMap({ map: 'office' })).map?.revision);
  const viewer = new Viewer('foxglove.sdk.v1');
  const outer = { xs: [0.2, 14.6, 14.6, 0.2], ys: [0.2, 0.2, 11.8, 11.8] };
  await client.catalog.createLayer({
    map: 'office',
    layer: { name: 'explored', kind: LayerKind.EXPLORATION, grid: { resolutionM: 0.1 } },
  });
  await client.exploration.startExploration({
    map: 'office',
    area: { outer },
    occupancyLayer: 'floor',
    explorationLayer: 'explored',
  });
  const scene = await viewer.subscribe<Scene>('/objects/explorations');
  await scene(({ entities }) => entities.length === 1);
  const { goal } = await client.exploration.claimGoal({
    map: 'office',
    robot: 'robin',
    pose: { x: 2, y: 6 },
  });
  const { entities } = await scene(({ entities }) => entities.length === 2);
  expectToMatch(schemas.SceneUpdate, { deletions: [], entities });
  expect(entities[1]?.texts[0]?.text).toBe('robin');
  expect(entities[1]?.spheres[0]?.pose.position.x).toBeCloseTo(goal?.position?.x ?? NaN);

  const objects = await viewer.subscribe<Scene>('/objects/objects');
  const count = (await objects()).entities.length;
  await putMug();
  await objects(({ entities }) => entities.length === count + 1);
  viewer.show(before);
  await objects(({ entities }) => entities.length === count);
  viewer.close();
});

test('a viewer sees what happens after a restart of the server', async () => {
  const viewer = new Viewer('foxglove.sdk.v1');
  const objects = await viewer.subscribe<Scene>('/objects/objects');
  const count = (await objects()).entities.length;
  await server.stop('SIGKILL');
  server = await serve(server.address);
  await putMug();
  await objects(({ entities }) => entities.length === count + 1);
  viewer.close();
});
