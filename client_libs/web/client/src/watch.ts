import { create, type MessageInitShape } from '@bufbuild/protobuf';
import { timestampDate } from '@bufbuild/protobuf/wkt';
import { Code, ConnectError } from '@connectrpc/connect';
import type { HypermapClient } from './client.js';
import {
  WatchRequestSchema,
  type Change,
  type WatchResponse,
} from './gen/hypermap/v1/watch_service_pb.js';
import { Backoff, isTransient, wait, type BackoffOptions } from './retry.js';

/** A revision, or a part of the first picture of the map. */
export interface WatchEvent {
  readonly revision: bigint;
  /** When it was made, and by whom; not told of a snapshot. */
  readonly time: Date | undefined;
  readonly author: string;
  /** None: the map has come to this revision, and nothing of what is watched changed. */
  readonly changes: Change[];
  /** The changes are a part of all there is: the last one is `complete`. */
  readonly snapshot: boolean;
  /** Begins a snapshot: what was told before does not hold any more. */
  readonly reset: boolean;
  readonly complete: boolean;
}

export type WatchState = 'connecting' | 'live' | 'disconnected';

export interface WatchOptions {
  /** Ends the watch, without an error. */
  signal?: AbortSignal;
  /** Told of each change of the connection; with `disconnected` why. */
  onState?: (state: WatchState, reason?: ConnectError) => void;
  /**
   * A connection that is silent for so long is given up. Must be longer than the server's
   * --watch_progress. Milliseconds, default 30000.
   */
  silenceMs?: number;
  backoff?: BackoffOptions;
}

/**
 * Tells what the request selects, then each change of it once and in order, for as long as it is
 * iterated. A connection that breaks is opened again, and goes on after the last revision that was
 * told whole; when the server does not keep the changes since then any more, a new snapshot comes.
 * Throws what trying again can't mend, such as a map that is not there.
 */
export async function* watch(
  client: HypermapClient,
  request: Omit<MessageInitShape<typeof WatchRequestSchema>, '$typeName' | 'coalesce'>,
  options: WatchOptions = {},
): AsyncGenerator<WatchEvent, void, undefined> {
  const { signal, onState, silenceMs = 30_000 } = options;
  const backoff = new Backoff(options.backoff);
  let told = request.startRevision;
  while (!signal?.aborted) {
    onState?.('connecting');
    const connection = new AbortController();
    const end = () => connection.abort();
    signal?.addEventListener('abort', end);
    let failure: ConnectError;
    try {
      const message = create(WatchRequestSchema, {
        ...request,
        startRevision: told,
        coalesce: true,
      });
      const live = once(() => onState?.('live'));
      const stream = client.changes.watch(message, { signal: connection.signal, onHeader: live });
      for await (const event of events(untilSilent(stream, silenceMs))) {
        live();
        backoff.reset();
        if (event.complete) told = event.revision;
        yield event;
      }
      failure = new ConnectError('the server ended the watch', Code.Unavailable);
    } catch (error) {
      failure = ConnectError.from(error);
    } finally {
      signal?.removeEventListener('abort', end);
      connection.abort();
    }
    if (signal?.aborted) return;
    if (failure.code === Code.OutOfRange && told !== undefined) {
      told = undefined;
      continue;
    }
    if (!isTransient(failure)) throw failure;
    onState?.('disconnected', failure);
    await wait(backoff.next(), signal);
  }
}

// Parts of a snapshot one by one; of a later revision all at once, so that a connection that breaks
// between its parts leaves no half of it behind.
async function* events(messages: AsyncIterable<WatchResponse>): AsyncGenerator<WatchEvent> {
  let parts: Change[] = [];
  let inSnapshot = false;
  for await (const message of messages) {
    for (const response of message.coalesced.length > 0 ? message.coalesced : [message]) {
      parts = parts.concat(response.changes);
      if (response.more && !response.snapshot) continue;
      yield {
        revision: response.revision,
        time: response.time && timestampDate(response.time),
        author: response.author,
        changes: parts,
        snapshot: response.snapshot,
        reset: response.snapshot && (response.reset || !inSnapshot),
        complete: !response.more,
      };
      inSnapshot = response.snapshot && response.more;
      parts = [];
    }
  }
}

// The clock stands still while the caller works on a message.
async function* untilSilent<T>(stream: AsyncIterable<T>, silenceMs: number): AsyncGenerator<T> {
  const iterator = stream[Symbol.asyncIterator]();
  for (;;) {
    const next = iterator.next();
    const result = await withDeadline(next, silenceMs);
    if (result.done) return;
    yield result.value;
  }
}

async function withDeadline<T>(promise: Promise<T>, ms: number): Promise<T> {
  let timer: ReturnType<typeof setTimeout> | undefined;
  const silence = new Promise<never>((_, reject) => {
    timer = setTimeout(() => {
      reject(new ConnectError(`the server was silent for ${ms} ms`, Code.Unavailable));
    }, ms);
  });
  // What becomes of the connection after it was given up is nobody's concern.
  promise.catch(() => undefined);
  try {
    return await Promise.race([promise, silence]);
  } finally {
    clearTimeout(timer);
  }
}

function once(action: () => void): () => void {
  let done = false;
  return () => {
    if (!done) action();
    done = true;
  };
}
