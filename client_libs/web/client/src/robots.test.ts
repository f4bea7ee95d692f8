import type { MessageInitShape } from '@bufbuild/protobuf';
import { timestampFromDate } from '@bufbuild/protobuf/wkt';
import { Code, ConnectError, createRouterTransport } from '@connectrpc/connect';
import { expect, test } from 'vitest';
import { createHypermapClient } from './client.js';
import {
  RobotService,
  type WatchRobotsResponseSchema,
} from './gen/hypermap/v1/robot_service_pb.js';
import { watchRobots } from './robots.js';

type Told = MessageInitShape<typeof WatchRobotsResponseSchema>;

const soon = { firstMs: 1, longestMs: 1 };
const lost = new ConnectError('lost', Code.Unavailable);
const missing = new ConnectError('no such map', Code.NotFound);
const robot = (name: string, x: number) => ({ report: { robot: name, pose: { x } } });

/** Watches a server that serves the given connections one after the other, then has no such map. */
async function follow(...connections: (Told | ConnectError)[][]) {
  const maps: string[] = [];
  const transport = createRouterTransport(({ service }) => {
    service(RobotService, {
      async *watchRobots({ map }) {
        maps.push(map);
        for (const message of connections[maps.length - 1] ?? [missing]) {
          if (message instanceof ConnectError) throw message;
          yield message;
        }
      },
    });
  });
  const states: string[] = [];
  const times: Date[] = [];
  const all = watchRobots(createHypermapClient(transport), 'm', { backoff: soon });
  const watching = (async () => {
    for await (const { robots, time } of all) {
      const told = [...robots].map(([name, { report }]) => `${name}@${report?.pose?.x}`);
      states.push(told.join(' '));
      times.push(time);
    }
  })();
  await expect(watching).rejects.toMatchObject({ code: Code.NotFound });
  return { maps, states, times };
}

test('a watch yields the state after each change', async () => {
  const time = new Date(1000);
  const { maps, states, times } = await follow([
    { reset: true, robots: [robot('a', 1), robot('b', 2)], time: timestampFromDate(time) },
    { robots: [robot('a', 3)] },
    { forgotten: ['b', 'unknown'] },
    missing,
  ]);
  expect(maps).toEqual(['m']);
  expect(states).toEqual(['a@1 b@2', 'a@3 b@2', 'a@3']);
  expect(times[0]).toEqual(time);
});

test('the parts of a state come together', async () => {
  const { states } = await follow([
    { reset: true, more: true, robots: [robot('a', 1)] },
    { robots: [robot('b', 2)] },
    missing,
  ]);
  expect(states).toEqual(['a@1 b@2']);
});

test('a lost connection is opened again, and what was forgotten meanwhile is gone', async () => {
  const { maps, states } = await follow(
    [{ reset: true, robots: [robot('a', 1), robot('b', 2)] }, lost],
    [{ reset: true, robots: [robot('b', 4)] }],
  );
  expect(maps).toEqual(['m', 'm', 'm']);
  expect(states).toEqual(['a@1 b@2', 'b@4']);
});

test('a watch that is aborted ends without an error', async () => {
  const stop = new AbortController();
  const transport = createRouterTransport(({ service }) => {
    service(RobotService, {
      async *watchRobots(_, { signal }) {
        yield { reset: true };
        await new Promise((resolve) => signal.addEventListener('abort', resolve));
      },
    });
  });
  let seen = 0;
  const options = { signal: stop.signal };
  for await (const { robots } of watchRobots(createHypermapClient(transport), 'm', options)) {
    expect(robots.size).toBe(0);
    seen++;
    stop.abort();
  }
  expect(seen).toBe(1);
});
