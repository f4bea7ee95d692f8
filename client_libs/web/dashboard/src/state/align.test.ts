// Another map is laid over the shown one, against a server that the test plays.
import {
  AnswerStatus,
  Code,
  ConnectError,
  create,
  EstimateTransformResponseSchema,
  GetCallerResponseSchema,
  LayerSchema,
  QueryAreaResponseSchema,
  QueryValueResponseSchema,
  Role,
  TransformAmbiguity,
  type HypermapClient,
  type MessageInitShape,
} from '@hypermap/client';
import { afterEach, beforeEach, expect, test, vi } from 'vitest';
import { LayerKind, MapState } from './model';

type Response = MessageInitShape<typeof EstimateTransformResponseSchema>;

const CLEAR: Response = {
  source: { map: 'attic', layer: 'floor', frameId: 'map', revision: 3n, incarnation: 8n },
  target: { map: 'office', layer: 'floor', frameId: 'map', revision: 12n, incarnation: 9n },
  best: { targetFromSource: { x: 2, y: -1.5, yaw: 0.25 }, score: 0.9 },
  covariance: [0.0001, 0, 0, 0, 0.0004, 0, 0, 0, 0.000001],
  inlierShare: 0.97,
  ambiguity: TransformAmbiguity.NONE,
};

let response: Response | Error = CLEAR;
const calls = { estimate: vi.fn(), set: vi.fn(), value: vi.fn(), area: vi.fn() };

const layer = (name: string, kind: LayerKind) => create(LayerSchema, { name, kind });
const FLOOR = layer('floor', LayerKind.OCCUPANCY);
const THINGS = layer('things', LayerKind.SEMANTIC);
const ATTIC = [
  layer('explorations', LayerKind.SEMANTIC),
  layer('seen', LayerKind.EXPLORATION),
  layer('chairs', LayerKind.SEMANTIC),
  FLOOR,
];

const part = { layer: 'floor', status: AnswerStatus.VALUE };

function fakeClient(): HypermapClient {
  return {
    catalog: {
      listLayers: () => Promise.resolve({ layers: ATTIC }),
      setTransform(request: unknown) {
        calls.set(request);
        return Promise.resolve({ revision: 13n });
      },
    },
    query: {
      estimateTransform(request: unknown) {
        calls.estimate(request);
        if (response instanceof Error) return Promise.reject(response);
        return Promise.resolve(create(EstimateTransformResponseSchema, response));
      },
      async *queryValue(request: unknown) {
        calls.value(request);
        const cells = { grid: { resolutionM: 1 }, rows: [0], colBegins: [0], colEnds: [1] };
        yield create(QueryValueResponseSchema, {
          revision: 2n,
          part: { ...part, cells: { ...cells, values: [1] } },
        });
      },
      async *queryArea(request: unknown) {
        calls.area(request);
        const objects = [{ id: 5n, label: 'chair' }];
        yield create(QueryAreaResponseSchema, { revision: 2n, part: { ...part, objects } });
      },
    },
  } as unknown as HypermapClient;
}

vi.mock('@hypermap/client', async (original) => ({
  ...(await original<object>()),
  createHypermapClient: fakeClient,
}));
vi.hoisted(() => vi.stubGlobal('location', { origin: 'http://127.0.0.1' }));

const align = await import('./align');
const { caller } = await import('./caller');
const { liveIncarnation } = await import('./live');
const { overlay } = await import('./overlay');
const places = await import('./place_pairs');
const { IDENTITY } = await import('./rigid');
const { layers, mapName, maps } = await import('./site');

const names = (of: readonly { name: string }[]) => of.map(({ name }) => name);

function entry(name: string, state = MapState.SERVING) {
  return { name, frameId: 'map', state, problem: '', incarnation: 1n };
}

let stop: () => void = () => undefined;

beforeEach(() => {
  response = CLEAR;
  caller.value = undefined;
  maps.value = [entry('office'), entry('attic'), entry('broken', MapState.CLOSED)];
  mapName.value = 'office';
  layers.value = [THINGS, FLOOR];
  liveIncarnation.value = 9n;
  align.chooseSource(undefined);
  stop = align.followAlignment();
  for (const call of Object.values(calls)) call.mockClear();
});
afterEach(() => stop());

/** Chooses the attic and waits until it is drawn. */
async function chooseAttic(): Promise<void> {
  align.chooseSource('attic');
  await vi.waitFor(() => expect(overlay.answer.value?.map).toBe('attic'));
}

test('other maps are offered, and of their layers those that can be compared', async () => {
  expect(align.otherMaps.value).toEqual(['attic']);
  expect(align.sourceMap.value).toBeUndefined();
  await chooseAttic();
  expect(names(align.sourceChoice.value)).toEqual(['floor', 'chairs']);
  expect(align.sourceLayer.value?.name).toBe('floor');
  expect(names(align.targetChoice.value)).toEqual(['floor']);

  align.chooseSourceLayer('chairs');
  expect(align.targetLayer.value?.name).toBe('things');
  layers.value = [THINGS];
  expect(names(align.sourceChoice.value)).toEqual(['chairs']);
  layers.value = [layer('seen', LayerKind.EXPLORATION)];
  expect(align.sourceLayer.value).toBeUndefined();
});

test('the overlay has the walls of a layer of occupancy, or the objects', async () => {
  await chooseAttic();
  expect(calls.value).toHaveBeenCalledWith(
    expect.objectContaining({
      scope: { map: 'attic', layers: ['floor'], incarnation: 0n },
      value: 'occupied',
    }),
  );
  expect(overlay.answer.value?.cells).toHaveLength(1);
  align.chooseSourceLayer('chairs');
  await vi.waitFor(() => expect(overlay.answer.value?.layer).toBe('chairs'));
  expect(calls.area).toHaveBeenCalledTimes(1);
  expect(overlay.answer.value?.objects.map(({ label }) => label)).toEqual(['chair']);
  expect(overlay.answer.value?.cells).toEqual([]);
});

test('an estimate lays the overlay in its place, as it was compared', async () => {
  await chooseAttic();
  expect(align.placement.value).toEqual(IDENTITY);
  await align.estimateFromLayers();
  expect(calls.estimate).toHaveBeenCalledWith({
    source: { scope: { map: 'attic', layers: ['floor'] } },
    target: { scope: { map: 'office', layers: ['floor'], incarnation: 9n } },
  });
  expect(align.placement.value).toMatchObject({ x: 2, y: -1.5, yaw: 0.25 });
  expect(calls.value).toHaveBeenLastCalledWith(
    expect.objectContaining({
      scope: { map: 'attic', layers: ['floor'], incarnation: 8n },
      asOf: { asOf: { case: 'atRevision', value: 3n } },
    }),
  );
  const answer = align.estimate.answer.value;
  expect(answer && align.deviationsOf(answer)).toEqual({
    x: expect.closeTo(0.01, 9) as number,
    y: expect.closeTo(0.02, 9) as number,
    yaw: expect.closeTo(0.001, 9) as number,
  });
});

test('a failed estimate tells why, and leaves the overlay where it was', async () => {
  await chooseAttic();
  await align.estimateFromLayers();
  response = new ConnectError('the grids are too large', Code.ResourceExhausted);
  await align.estimateFromLayers();
  expect(align.estimate.problem.value).toBe('the grids are too large');
  expect(align.estimate.answer.value).toBeUndefined();
  expect(align.placement.value).toMatchObject({ x: 2 });
});

test('a covariance that is infinite has no deviations', async () => {
  await chooseAttic();
  response = { ...CLEAR, covariance: [] };
  await align.estimateFromLayers();
  const answer = align.estimate.answer.value;
  expect(answer && align.deviationsOf(answer)).toBeUndefined();
});

test('applying sets the frame of the source in the target', async () => {
  await chooseAttic();
  await align.applyEstimate();
  expect(calls.set).not.toHaveBeenCalled();
  await align.estimateFromLayers();
  expect(align.applyObstacle.value).toBeUndefined();
  await align.applyEstimate();
  expect(calls.set.mock.calls).toEqual([
    [
      {
        map: 'office',
        incarnation: 9n,
        transform: {
          parentFrameId: 'map',
          childFrameId: 'attic',
          parentFromChild: expect.objectContaining({ x: 2, y: -1.5, yaw: 0.25 }) as object,
        },
      },
    ],
  ]);
  const done = { childFrameId: 'attic', parentFrameId: 'map', revision: 13n };
  expect(align.applied.answer.value).toEqual(done);
  await align.estimateFromLayers();
  expect(align.applied.answer.value).toBeUndefined();
});

test('a source with a frame of its own keeps its name', async () => {
  await chooseAttic();
  response = { ...CLEAR, source: { ...CLEAR.source, frameId: 'robot1' } };
  await align.estimateFromLayers();
  const answer = align.estimate.answer.value;
  expect(answer && align.childFrameOf(answer)).toBe('robot1');
});

test('an ambiguous estimate is applied only if the user insists, and only that one', async () => {
  await chooseAttic();
  response = { ...CLEAR, ambiguity: TransformAmbiguity.RUNNER_UP };
  await align.estimateFromLayers();
  expect(align.applyObstacle.value).toBe('ambiguous');
  await align.applyEstimate();
  expect(calls.set).not.toHaveBeenCalled();
  align.applyAllTheSame.value = true;
  await align.applyEstimate();
  expect(calls.set).toHaveBeenCalledTimes(1);
  await align.estimateFromLayers();
  expect(align.applyObstacle.value).toBe('ambiguous');
});

test('who may not set transforms can only look', async () => {
  await chooseAttic();
  await align.estimateFromLayers();
  const rpcs = [{ rpc: 'hypermap.v1.CatalogService/SetTransform', least: Role.EDITOR }];
  const known = { hasIdentities: true, rpcs };
  caller.value = create(GetCallerResponseSchema, { ...known, role: Role.READER });
  expect(align.applyObstacle.value).toBe('role');
  await align.applyEstimate();
  expect(calls.set).not.toHaveBeenCalled();
  caller.value = create(GetCallerResponseSchema, { ...known, role: Role.EDITOR });
  expect(align.applyObstacle.value).toBeUndefined();
});

/** Clicks two pairs on the overlay as it lies, each belonging at `offset` from there. */
function clickPairs(offset: readonly [number, number]): void {
  for (const [x, y] of [
    [0, 0],
    [4, 0],
  ] as const) {
    places.beginPair([x, y], align.placement.value);
    places.endPair([x + offset[0], y + offset[1]]);
  }
}

test('pairs are clicked on the overlay as it lies, and kept in the frame of the source', async () => {
  await chooseAttic();
  align.placement.value = { x: 4, y: 2, yaw: Math.PI / 2 };
  places.beginPair([4, 3], align.placement.value);
  expect(places.pairs.value).toEqual([]);
  // An estimate that arrives between the clicks changes nothing.
  align.placement.value = IDENTITY;
  places.endPair([7, 8]);
  expect(places.begunPair.value).toBeUndefined();
  const [pair] = places.pairs.value;
  expect(pair?.source[0]).toBeCloseTo(1, 9);
  expect(pair?.source[1]).toBeCloseTo(0, 9);
  expect(pair?.target).toEqual([7, 8]);
  places.endPair([0, 0]);
  expect(places.pairs.value).toHaveLength(1);
});

test('from two pairs on the transform is estimated from them', async () => {
  await chooseAttic();
  clickPairs([2, -1]);
  const [first, second] = places.pairs.value;
  if (first) places.removePair(first);
  await align.estimateFromPairs();
  expect(calls.estimate).not.toHaveBeenCalled();
  if (second) places.removePair(second);

  clickPairs([2, -1]);
  const best = { targetFromSource: { x: 2, y: -1, yaw: 0 }, score: 1 };
  response = { ...CLEAR, best, agreeing: [{ source: 1n, target: 1n, residualM: 0.03 }] };
  await align.estimateFromPairs();
  expect(calls.estimate).toHaveBeenCalledWith({
    source: { scope: { map: 'attic' } },
    target: { scope: { map: 'office', incarnation: 9n } },
    pairs: [
      { name: '1', source: { x: 0, y: 0 }, target: { x: 2, y: -1 } },
      { name: '2', source: { x: 4, y: 0 }, target: { x: 6, y: -1 } },
    ],
  });
  expect(align.placement.value).toMatchObject({ x: 2, y: -1 });
});

test('an estimate has a residual for each of its pairs', async () => {
  await chooseAttic();
  clickPairs([5, 3]);
  const best = { targetFromSource: { x: 2, y: -1, yaw: 0 }, score: 1 };
  response = { ...CLEAR, best, agreeing: [{ source: 1n, target: 1n, residualM: 0.03 }] };
  await align.estimateFromPairs();
  const [first, second] = places.pairs.value;
  places.beginPair([1, 1], IDENTITY);
  places.endPair([2, 2]);
  const third = places.pairs.value[2];
  const answer = align.estimate.answer.value;
  if (!answer || !first || !second || !third) throw new Error('something is missing');
  expect(align.resultOf(answer, first)).toEqual({ agrees: false, residualM: 5 });
  expect(align.resultOf(answer, second)).toEqual({ agrees: true, residualM: 0.03 });
  expect(align.resultOf(answer, third)).toBeUndefined();
  // The others keep their results when one is removed.
  places.removePair(first);
  expect(align.resultOf(answer, second)?.agrees).toBe(true);
});

test('everything is forgotten with another source', async () => {
  await chooseAttic();
  await align.estimateFromLayers();
  clickPairs([1, 1]);
  align.chooseSource(undefined);
  expect(places.pairs.value).toEqual([]);
  expect(align.estimate.answer.value).toBeUndefined();
  expect(align.placement.value).toEqual(IDENTITY);
  expect(overlay.answer.value).toBeUndefined();
});
