// The robots of the shown map, as the server tells them.
import {
  create,
  timestampFromDate,
  WatchRobotsResponseSchema,
  type HypermapClient,
  type MessageInitShape,
} from '@hypermap/client';
import { beforeEach, expect, test, vi } from 'vitest';

type Told = MessageInitShape<typeof WatchRobotsResponseSchema>;

/** The server that the page is connected to. */
const server = {
  messages: [] as Told[],
  /** The maps whose robots are watched. */
  watched: [] as string[],
};

async function* watchRobots({ map }: { map: string }, { signal }: { signal: AbortSignal }) {
  server.watched.push(map);
  for (const message of server.messages) yield create(WatchRobotsResponseSchema, message);
  const end = new Promise((resolve) => signal.addEventListener('abort', resolve));
  if (!signal.aborted) await end;
  server.watched.splice(server.watched.indexOf(map), 1);
}

vi.mock('@hypermap/client', async (original) => ({
  ...(await original<object>()),
  createHypermapClient: () => ({ robots: { watchRobots } }) as unknown as HypermapClient,
}));
/** Whether the page is hidden. `look` tells the page that this has changed. */
const page = vi.hoisted(() => {
  let look = () => {};
  const document = { hidden: false, addEventListener: (_: string, f: () => void) => (look = f) };
  vi.stubGlobal('location', { origin: 'http://127.0.0.1' });
  vi.stubGlobal('document', document);
  return { document, look: () => look() };
});

const { liveIncarnation } = await import('./live');
const { robots, seenWords, startRobots } = await import('./robots');
const { mapName } = await import('./site');

const SERVER_TIME = new Date('2026-01-01T12:00:00Z');

function robot(name: string, inMapFrame = true) {
  const seenTime = timestampFromDate(new Date(SERVER_TIME.getTime() - 3000));
  const report = { robot: name, pose: { x: 1, y: 2, yaw: 0.5 }, state: 'driving' };
  return { report, inMapFrame, online: true, seenTime };
}

beforeEach(async () => {
  mapName.value = undefined;
  liveIncarnation.value = 0n;
  await vi.waitUntil(() => server.watched.length === 0);
  server.messages = [
    { reset: true, time: timestampFromDate(SERVER_TIME), robots: [robot('a'), robot('b', false)] },
  ];
});

startRobots();

function show(map: string): void {
  mapName.value = map;
  liveIncarnation.value = 7n;
}

test('robots whose pose is in the frame of the map are placed, at the time of this page', async () => {
  const before = Date.now();
  show('office');
  await vi.waitUntil(() => robots.value.size > 0);
  expect([...robots.value.keys()]).toEqual(['a']);
  const found = robots.value.get('a');
  expect(found).toMatchObject({ position: [1, 2], yaw: 0.5, online: true, doing: 'driving' });
  expect(found?.seen.getTime()).toBeGreaterThanOrEqual(before - 3000);
  expect(found?.seen.getTime()).toBeLessThanOrEqual(Date.now() - 3000);
});

test('another map has other robots', async () => {
  show('office');
  await vi.waitUntil(() => robots.value.size > 0);
  server.messages = [{ reset: true }];
  mapName.value = 'hall';
  expect(robots.value.size).toBe(0);
  await vi.waitUntil(() => server.watched.join() === 'hall');
});

test('a page that nobody sees does not watch', async () => {
  show('office');
  await vi.waitUntil(() => server.watched.length === 1);
  page.document.hidden = true;
  page.look();
  await vi.waitUntil(() => server.watched.length === 0);
  page.document.hidden = false;
  page.look();
  await vi.waitUntil(() => server.watched.length === 1);
});

test('the age of a position is told in seconds first', () => {
  const seen = new Date('2026-01-01T12:00:00Z');
  const after = (seconds: number) => new Date(seen.getTime() + 1000 * seconds);
  const position: [number, number] = [0, 0];
  const robot = { name: 'a', position, yaw: 0, online: true, doing: '', seen };
  expect(seenWords(robot, after(-1))).toBe('0 s ago');
  expect(seenWords(robot, after(2.9))).toBe('2 s ago');
  expect(seenWords({ ...robot, online: false }, after(30))).toBe('offline, last seen 30 s ago');
  expect(seenWords({ ...robot, online: false }, after(300))).toBe('offline, last seen 5 min ago');
});
