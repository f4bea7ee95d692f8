import type { MessageInitShape } from '@bufbuild/protobuf';
import { Code, ConnectError, createRouterTransport } from '@connectrpc/connect';
import { expect, test } from 'vitest';
import { createHypermapClient } from './client.js';
import {
  WatchService,
  type WatchRequest,
  type WatchResponseSchema,
} from './gen/hypermap/v1/watch_service_pb.js';
import { watch, type WatchEvent, type WatchOptions, type WatchState } from './watch.js';

type Told = MessageInitShape<typeof WatchResponseSchema>;
type Connection = (request: WatchRequest, signal: AbortSignal) => AsyncIterable<Told>;

const soon = { firstMs: 1, longestMs: 1 };
const change = (id: bigint) => ({ objectId: id });

async function* tell(...messages: (Told | ConnectError)[]): AsyncIterable<Told> {
  for (const message of messages) {
    if (message instanceof ConnectError) throw message;
    yield message;
  }
}

/**
 * Watches a server that serves the given connections one after the other, until the last has ended.
 */
async function follow(
  connections: Connection[],
  options: WatchOptions = {},
  start?: bigint,
  incarnation = 0n,
) {
  const requests: WatchRequest[] = [];
  const stop = new AbortController();
  const transport = createRouterTransport(({ service }) => {
    service(WatchService, {
      watch(request, { signal }) {
        requests.push(request);
        const connection = connections[requests.length - 1];
        if (!connection) {
          stop.abort();
          return tell();
        }
        return connection(request, signal);
      },
    });
  });
  const events: WatchEvent[] = [];
  const scope = { map: 'm', incarnation };
  const request = start === undefined ? { scope } : { scope, startRevision: start };
  const all = watch(createHypermapClient(transport), request, {
    backoff: soon,
    signal: stop.signal,
    ...options,
  });
  for await (const event of all) events.push(event);
  const ids = (event: WatchEvent) => event.changes.map(({ objectId }) => objectId);
  return {
    requests,
    events,
    told: events.map((event) => [event.revision, ids(event)] as const),
    starts: requests.map(({ startRevision }) => startRevision),
    resumed: requests.map(({ startRevision, scope }) => [startRevision, scope?.incarnation]),
  };
}

const lost = new ConnectError('lost', Code.Unavailable);
const replaced = new ConnectError('m is another incarnation by now', Code.Aborted);
// Incarnations use all 64 bits, more than a number can hold.
const before = 2n ** 64n - 1n;
const after = 2n ** 63n + 1n;

test('resumes after the last complete revision and never yields a part of one', async () => {
  const { told, starts } = await follow([
    () =>
      tell(
        { revision: 4n, snapshot: true, changes: [change(1n)] },
        { revision: 5n, changes: [change(2n)] },
        { revision: 6n, changes: [change(3n)], more: true },
        lost,
      ),
    () =>
      tell(
        { revision: 6n, changes: [change(3n)], more: true },
        { revision: 6n, changes: [change(4n)] },
        lost,
      ),
  ]);
  expect(told).toEqual([
    [4n, [1n]],
    [5n, [2n]],
    [6n, [3n, 4n]],
  ]);
  expect(starts).toEqual([undefined, 5n, 6n]);
});

test('yields the parts of a snapshot as they arrive, and restarts a broken one', async () => {
  const { events, starts } = await follow([
    () =>
      tell(
        { revision: 4n, snapshot: true, more: true, changes: [change(1n)] },
        { revision: 4n, snapshot: true, more: true, changes: [change(2n)] },
        lost,
      ),
    () =>
      tell(
        { revision: 7n, snapshot: true, more: true, changes: [change(1n)] },
        { revision: 7n, snapshot: true, changes: [change(2n)] },
      ),
  ]);
  expect(events.map(({ reset, complete }) => [reset, complete])).toEqual([
    [true, false],
    [false, false],
    [true, false],
    [false, true],
  ]);
  expect(starts).toEqual([undefined, undefined, 7n]);
});

test('coalesced messages are yielded one by one', async () => {
  const { told, requests } = await follow([
    () =>
      tell({
        coalesced: [
          { revision: 2n, changes: [change(1n)], more: true },
          { revision: 2n, changes: [change(2n)] },
          { revision: 3n },
        ],
      }),
  ]);
  expect(told).toEqual([
    [2n, [1n, 2n]],
    [3n, []],
  ]);
  expect(requests[0]?.coalesce).toBe(true);
});

test('requests a new snapshot when the missed changes have been compacted', async () => {
  const { starts } = await follow(
    [
      () => tell(new ConnectError('the oldest is 90', Code.OutOfRange)),
      () => tell({ revision: 99n, snapshot: true }),
    ],
    {},
    5n,
  );
  expect(starts).toEqual([5n, undefined, 99n]);
});

test('C5 resumes in the incarnation that it saw', async () => {
  const { events, resumed } = await follow([
    () => tell({ revision: 4n, incarnation: before, snapshot: true }, lost),
    () => tell({ coalesced: [{ revision: 5n, incarnation: before }] }, lost),
  ]);
  expect(events.map(({ incarnation }) => incarnation)).toEqual([before, before]);
  expect(resumed).toEqual([
    [undefined, 0n],
    [4n, before],
    [5n, before],
  ]);
});

test('C5 shows the new map when a map vanishes and comes back under its name', async () => {
  const { events, resumed } = await follow([
    () =>
      tell(
        { revision: 4n, incarnation: before, snapshot: true, changes: [change(1n)] },
        { revision: 5n, incarnation: before, changes: [change(2n)] },
        lost,
      ),
    () => tell(replaced),
    () =>
      tell(
        { revision: 1n, incarnation: after, snapshot: true, more: true, changes: [change(7n)] },
        { revision: 1n, incarnation: after, snapshot: true, changes: [change(8n)] },
        { revision: 2n, incarnation: after, changes: [change(9n)] },
        lost,
      ),
  ]);
  const summary = events.map((event) => [event.revision, event.incarnation, event.reset]);
  expect(summary).toEqual([
    [4n, before, true],
    [5n, before, false],
    [1n, after, true],
    [1n, after, false],
    [2n, after, false],
  ]);
  expect(resumed).toEqual([
    [undefined, 0n],
    [5n, before],
    [undefined, 0n],
    [2n, after],
  ]);
});

test('C5 a revision that was kept from another incarnation leads to a snapshot', async () => {
  const { events, resumed } = await follow(
    [() => tell(replaced), () => tell({ revision: 9n, incarnation: after, snapshot: true })],
    {},
    5n,
    before,
  );
  expect(events.map(({ revision, reset }) => [revision, reset])).toEqual([[9n, true]]);
  expect(resumed).toEqual([
    [5n, before],
    [undefined, 0n],
    [9n, after],
  ]);
});

test('C5 never yields a change of another incarnation', async () => {
  const { told, resumed } = await follow([
    () => tell({ revision: 4n, incarnation: before, snapshot: true }, lost),
    () => tell({ revision: 5n, incarnation: after, changes: [change(1n)] }),
    () => tell({ revision: 5n, incarnation: after, snapshot: true, changes: [change(2n)] }),
  ]);
  expect(told).toEqual([
    [4n, []],
    [5n, [2n]],
  ]);
  expect(resumed.slice(0, 3)).toEqual([
    [undefined, 0n],
    [4n, before],
    [undefined, 0n],
  ]);
});

test('C5 a snapshot of a given incarnation is not replaced by one of another', async () => {
  const failure = follow([() => tell(replaced)], {}, undefined, before);
  await expect(failure).rejects.toMatchObject({ code: Code.Aborted });
});

test('throws errors that a retry cannot resolve', async () => {
  for (const code of [Code.NotFound, Code.Unauthenticated, Code.InvalidArgument]) {
    const failure = follow([() => tell(new ConnectError('no', code))]);
    await expect(failure).rejects.toMatchObject({ code });
  }
});

test('closes a silent connection and reconnects', async () => {
  const silent: Connection = async function* (_, signal) {
    yield { revision: 1n, snapshot: true };
    await new Promise((resolve) => signal.addEventListener('abort', resolve));
  };
  const states: [WatchState, string | undefined][] = [];
  const { starts } = await follow([silent], {
    silenceMs: 20,
    onState: (state, reason) => states.push([state, reason?.rawMessage]),
  });
  expect(starts).toEqual([undefined, 1n]);
  expect(states.slice(0, 3)).toEqual([
    ['connecting', undefined],
    ['live', undefined],
    ['disconnected', 'the server was silent for 20 ms'],
  ]);
});

test('leaving the loop ends the call', async () => {
  let ended: (() => void) | undefined;
  const end = new Promise<void>((resolve) => (ended = resolve));
  const transport = createRouterTransport(({ service }) => {
    service(WatchService, {
      async *watch(_, { signal }) {
        signal.addEventListener('abort', () => ended?.());
        yield { revision: 1n };
        await end;
      },
    });
  });
  for await (const { revision } of watch(createHypermapClient(transport), {
    scope: { map: 'm' },
  })) {
    expect(revision).toBe(1n);
    break;
  }
  await end;
});
