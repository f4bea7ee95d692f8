// A map that vanishes and comes back under its name while the page shows it.
import {
  ChangeKind,
  Code,
  ConnectError,
  WatchResponseSchema,
  create,
  type HypermapClient,
  type MessageInitShape,
  type WatchRequest,
} from '@hypermap/client';
import { afterAll, beforeAll, beforeEach, expect, test, vi } from 'vitest';

type Told = MessageInitShape<typeof WatchResponseSchema>;

/** The server that the page is connected to. */
const server = {
  /** The incarnations of its maps by name. */
  maps: new Map<string, bigint>(),
  /** The messages and the error of each watch to come. A watch without an error stays open. */
  watches: [] as { told: Told[]; error?: ConnectError }[],
  requests: [] as WatchRequest[],
  edits: [] as { incarnation: bigint }[],
};

async function* watch(request: WatchRequest, { signal }: { signal: AbortSignal }) {
  server.requests.push(request);
  const { told, error } = server.watches.shift() ?? { told: [] };
  for (const message of told) yield create(WatchResponseSchema, message);
  if (error) throw error;
  await new Promise((resolve) => signal.addEventListener('abort', resolve));
}

function fakeClient() {
  const listMaps = () => {
    const maps = [...server.maps].map(([name, incarnation]) => {
      return { name, frameId: 'map', problem: '', incarnation };
    });
    return Promise.resolve({ maps });
  };
  const applyEdits = (request: { incarnation: bigint }) => {
    server.edits.push(request);
    return Promise.resolve({ revision: 6n, objectIds: [3n] });
  };
  const fake = {
    catalog: { listMaps, listLayers: () => Promise.resolve({ layers: [] }) },
    changes: { watch, listRevisions: () => Promise.resolve({ oldestRevision: 0n, revisions: [] }) },
    query: { queryArea: async function* () {} },
    edit: { applyEdits },
  };
  return fake as unknown as HypermapClient;
}

vi.mock('@hypermap/client', async (original) => ({
  ...(await original<object>()),
  createHypermapClient: fakeClient,
}));
vi.hoisted(() => {
  vi.stubGlobal('location', { origin: 'http://127.0.0.1' });
  vi.stubGlobal('document', { hidden: false });
});

const { changes } = await import('./changes');
const { status } = await import('./connection');
const { editObject, startEdits, undoTitle } = await import('./edits');
const { expectIncarnation, live, liveIncarnation, liveRevision, start } = await import('./live');
const { selectedId } = await import('./selection');
const { leftRevision, startShowing } = await import('./show_map');
const { mapName } = await import('./site');
const { asOf, showRevision, startTime } = await import('./time');

// Incarnations use all 64 bits, more than a number can hold.
const BEFORE = 2n ** 64n - 1n;
const AFTER = 2n ** 64n - 2n;

const put = (id: bigint, label: string) => ({
  kind: ChangeKind.PUT,
  layer: 'objects',
  objectId: id,
  object: { id, label },
});
const snapshot = (revision: bigint, incarnation: bigint, label: string): Told => ({
  revision,
  incarnation,
  snapshot: true,
  changes: [put(1n, label)],
});
const CHAIR_AND_CUP: Told[] = [
  snapshot(4n, BEFORE, 'chair'),
  { revision: 5n, incarnation: BEFORE, changes: [put(2n, 'cup')] },
];
const labels = () => [...live.value.objects('objects').values()].map(({ label }) => label);
const starts = () =>
  server.requests.map(({ startRevision, scope }) => [startRevision, scope?.incarnation]);

/** Gives the page time for retries, but not for the next poll of the maps. */
const soon = () => vi.advanceTimersByTimeAsync(1000);
const afterPoll = () => vi.advanceTimersByTimeAsync(5000);
/** Keeps the server silent for so long that the page closes the connection and resumes. */
const connectionLost = () => vi.advanceTimersByTimeAsync(35_000);

beforeAll(() => {
  vi.useFakeTimers();
  asOf.value = 2n;
  expectIncarnation(BEFORE);
  startTime();
  startShowing();
  start();
  startEdits();
});

beforeEach(() => {
  server.requests = [];
  server.edits = [];
});

afterAll(() => vi.useRealTimers());

/** Makes the page keep an edit, a selected object, an earlier revision and a change of the map. */
async function useMap(): Promise<void> {
  const object = live.value.find(1n)?.object;
  await editObject({ title: 'draw', layer: 'objects', before: undefined, after: object });
  selectedId.value = 1n;
  showRevision(2n);
  await soon();
  expect([asOf.value, undoTitle.value, changes.value.length]).toEqual([2n, 'draw', 1]);
}

function expectNothingIsKept(): void {
  expect([asOf.value, undoTitle.value, selectedId.value]).toEqual([
    undefined,
    undefined,
    undefined,
  ]);
  expect(changes.value).toEqual([]);
}

test('C5 an address of another incarnation shows the newest revision and says so', async () => {
  server.maps = new Map([['bookmarked', AFTER]]);
  server.watches = [{ told: [snapshot(9n, AFTER, 'plant')] }];
  mapName.value = 'bookmarked';
  await soon();
  expect([asOf.value, leftRevision.value]).toEqual([undefined, 2n]);
  expect([labels(), liveRevision.value, liveIncarnation.value]).toEqual([['plant'], 9n, AFTER]);
});

test('C5 a map that was replaced during a lost connection is shown anew', async () => {
  server.maps = new Map([['site', BEFORE]]);
  server.watches = [{ told: CHAIR_AND_CUP }];
  mapName.value = 'site';
  await soon();
  expect([labels(), liveRevision.value]).toEqual([['chair', 'cup'], 5n]);
  expect(liveIncarnation.value).toBe(BEFORE);
  await useMap();
  expect(server.edits.map(({ incarnation }) => incarnation)).toEqual([BEFORE]);

  server.maps = new Map([['site', AFTER]]);
  const error = new ConnectError('site is another incarnation by now', Code.Aborted);
  server.watches = [{ told: [], error }, { told: [snapshot(9n, AFTER, 'plant')] }];
  await connectionLost();
  expect(starts().slice(0, 3)).toEqual([
    [undefined, 0n],
    [5n, BEFORE],
    [undefined, 0n],
  ]);
  expect([labels(), liveRevision.value]).toEqual([['plant'], 9n]);
  expect(liveIncarnation.value).toBe(AFTER);
  expect(status.value).toBe('live');
  expectNothingIsKept();
});

test('C5 a map that was deleted and made again is shown again', async () => {
  server.maps = new Map([['hall', BEFORE]]);
  server.watches = [{ told: CHAIR_AND_CUP }];
  mapName.value = 'hall';
  await soon();
  await useMap();

  server.maps = new Map();
  server.watches = [{ told: [], error: new ConnectError('no map hall', Code.NotFound) }];
  await connectionLost();
  expect(status.value).toBe('error');
  const asked = server.requests.length;
  await afterPoll();
  expect(server.requests.length).toBe(asked);

  server.maps = new Map([['hall', AFTER]]);
  server.watches = [{ told: [snapshot(1n, AFTER, 'plant')] }];
  await afterPoll();
  await soon();
  expect(status.value).toBe('live');
  expect([labels(), liveRevision.value]).toEqual([['plant'], 1n]);
  expect(liveIncarnation.value).toBe(AFTER);
  expectNothingIsKept();
});

test('C5 a map that does not exist yet is shown when it is created', async () => {
  server.maps = new Map();
  server.watches = [{ told: [], error: new ConnectError('no map attic', Code.NotFound) }];
  mapName.value = 'attic';
  await soon();
  expect(status.value).toBe('error');
  server.maps = new Map([['attic', AFTER]]);
  server.watches = [{ told: [snapshot(0n, AFTER, 'chest')] }];
  await afterPoll();
  expect([labels(), status.value]).toEqual([['chest'], 'live']);
});

test('C5 a map that is listed but cannot be watched is not asked for at every poll', async () => {
  server.maps = new Map([['torn', BEFORE]]);
  server.watches = [{ told: [], error: new ConnectError('a page is torn', Code.DataLoss) }];
  mapName.value = 'torn';
  await afterPoll();
  await afterPoll();
  expect([server.requests.length, status.value]).toEqual([1, 'error']);

  server.maps = new Map([['torn', AFTER]]);
  server.watches = [{ told: [snapshot(1n, AFTER, 'plant')] }];
  await afterPoll();
  await soon();
  expect([labels(), status.value]).toEqual([['plant'], 'live']);
});
