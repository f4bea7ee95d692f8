import { timestampDate } from '@bufbuild/protobuf/wkt';
import { Code, ConnectError } from '@connectrpc/connect';
import type { HypermapClient } from './client.js';
import type { RobotPresence, WatchRobotsResponse } from './gen/hypermap/v1/robot_service_pb.js';
import { Backoff, isTransient, wait, type BackoffOptions } from './retry.js';
import { untilSilent } from './watch.js';

/** The robots of a map at one moment. */
export interface RobotsState {
  /** By name. Each knows whether its pose is in the map's own frame, see `inMapFrame`. */
  readonly robots: ReadonlyMap<string, RobotPresence>;
  /** The time of this state by the server's clock, to tell how long ago robots were seen. */
  readonly time: Date;
}

export interface WatchRobotsOptions {
  /** Ends the watch without an error when it is aborted. */
  signal?: AbortSignal;
  /**
   * A connection without a message for this long is closed and opened again. Must be longer than
   * the server's --watch_progress. Milliseconds, default 30000.
   */
  silenceMs?: number;
  backoff?: BackoffOptions;
}

/**
 * Yields all robots of a map, then again whenever one reports, goes offline or is forgotten, and
 * now and then although nothing has changed. Reconnects after a lost connection; the last state
 * stays valid until the server has told all robots again. Throws errors that a retry can't resolve,
 * for example if the map does not exist.
 */
export async function* watchRobots(
  client: HypermapClient,
  map: string,
  { signal, silenceMs = 30_000, backoff: backoffOptions }: WatchRobotsOptions = {},
): AsyncGenerator<RobotsState, void, undefined> {
  const backoff = new Backoff(backoffOptions);
  while (!signal?.aborted) {
    const connection = new AbortController();
    const end = () => connection.abort();
    signal?.addEventListener('abort', end);
    try {
      const stream = client.robots.watchRobots({ map }, { signal: connection.signal });
      for await (const state of states(untilSilent(stream, silenceMs))) {
        backoff.reset();
        yield state;
      }
    } catch (error) {
      if (signal?.aborted) return;
      if (!isTransient(error)) throw ConnectError.from(error, Code.Unknown);
    } finally {
      signal?.removeEventListener('abort', end);
      connection.abort();
    }
    await wait(backoff.next(), signal);
  }
}

// Joins the parts of a state.
async function* states(messages: AsyncIterable<WatchRobotsResponse>): AsyncGenerator<RobotsState> {
  let robots = new Map<string, RobotPresence>();
  for await (const message of messages) {
    if (message.reset) robots = new Map();
    for (const name of message.forgotten) robots.delete(name);
    for (const robot of message.robots) robots.set(robot.report?.robot ?? '', robot);
    if (message.more) continue;
    const time = message.time ? timestampDate(message.time) : new Date();
    yield { robots: new Map(robots), time };
  }
}
