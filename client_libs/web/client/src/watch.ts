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

/** A commit, or a part of a snapshot of the map. */
export interface WatchEvent {
  readonly revision: bigint;
  /**
   * The incarnation of the map to which the revision belongs. Another one means that another map has
   * taken the name, whose revisions can't be compared. It changes only where `reset` is set.
   */
  readonly incarnation: bigint;
  /** The time of the commit. Undefined for a snapshot. */
  readonly time: Date | undefined;
  /** The author of the commit. Empty for a snapshot. */
  readonly author: string;
  /** Empty if nothing that the request selects has changed up to this revision. */
  readonly changes: Change[];
  /** Whether the changes are a part of a snapshot; its last part is `complete`. */
  readonly snapshot: boolean;
  /** Whether a snapshot begins, which replaces everything that was received before. */
  readonly reset: boolean;
  /** Whether the event ends its commit or snapshot. */
  readonly complete: boolean;
}

export type WatchState = 'connecting' | 'live' | 'disconnected';

export interface WatchOptions {
  /** Ends the watch without an error when it is aborted. */
  signal?: AbortSignal;
  /** Called for each change of the connection's state; `disconnected` comes with a reason. */
  onState?: (state: WatchState, reason?: ConnectError) => void;
  /**
   * A connection without a message for this long is closed and opened again. Must be longer than
   * the server's --watch_progress. Milliseconds, default 30000.
   */
  silenceMs?: number;
  backoff?: BackoffOptions;
}

/**
 * Yields a snapshot of everything that the request selects, then each change of it once and in
 * order, as long as the caller iterates. After a lost connection it reconnects and resumes after
 * the last complete revision, in the incarnation that it saw. If the server has compacted the changes
 * since then, or if the map is another incarnation by now, a new snapshot follows. Throws errors that
 * a retry can't resolve, for example if the map does not exist, or if it is another incarnation than
 * `request.scope` names and there is no revision to resume from.
 */
export async function* watch(
  client: HypermapClient,
  request: Omit<MessageInitShape<typeof WatchRequestSchema>, '$typeName' | 'coalesce'>,
  options: WatchOptions = {},
): AsyncGenerator<WatchEvent, void, undefined> {
  const { signal, onState, silenceMs = 30_000 } = options;
  const backoff = new Backoff(options.backoff);
  let told = request.startRevision;
  let incarnation = request.scope?.incarnation ?? 0n; // 0: any.
  while (!signal?.aborted) {
    onState?.('connecting');
    const connection = new AbortController();
    const end = () => connection.abort();
    signal?.addEventListener('abort', end);
    let failure: ConnectError;
    try {
      const message = create(WatchRequestSchema, {
        ...request,
        scope: { ...request.scope, incarnation },
        startRevision: told,
        coalesce: true,
      });
      const live = once(() => onState?.('live'));
      const stream = client.changes.watch(message, { signal: connection.signal, onHeader: live });
      for await (const event of events(untilSilent(stream, silenceMs))) {
        live();
        backoff.reset();
        checkIncarnation(event, incarnation);
        if (event.complete) ({ revision: told, incarnation } = event);
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
    const isAnotherMap = failure.code === Code.Aborted;
    if ((isAnotherMap || failure.code === Code.OutOfRange) && told !== undefined) {
      told = undefined;
      incarnation = 0n;
      continue;
    }
    if ((isAnotherMap && incarnation !== 0n) || !isTransient(failure)) throw failure;
    onState?.('disconnected', failure);
    await wait(backoff.next(), signal);
  }
}

// Throws ABORTED for changes of another incarnation than the caller has. A server refuses to resume
// such a watch; this check keeps two histories apart even if it does not.
function checkIncarnation(event: WatchEvent, wanted: bigint): void {
  if (wanted === 0n || event.incarnation === wanted || event.snapshot) return;
  const message = `the map has another incarnation: ${event.incarnation}, not ${wanted}`;
  throw new ConnectError(message, Code.Aborted);
}

// Yields the parts of a snapshot one by one. The parts of a later revision are joined, so that a
// connection that is lost between them leaves no incomplete revision behind.
async function* events(messages: AsyncIterable<WatchResponse>): AsyncGenerator<WatchEvent> {
  let parts: Change[] = [];
  let inSnapshot = false;
  for await (const message of messages) {
    for (const response of message.coalesced.length > 0 ? message.coalesced : [message]) {
      parts = parts.concat(response.changes);
      if (response.more && !response.snapshot) continue;
      yield {
        revision: response.revision,
        incarnation: response.incarnation,
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

/**
 * Passes messages on, and throws if the next one does not arrive in time. The time that the caller
 * takes for a message does not count.
 */
export async function* untilSilent<T>(
  stream: AsyncIterable<T>,
  silenceMs: number,
): AsyncGenerator<T> {
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
  // After the deadline nobody awaits this promise, and its rejection must not count as unhandled.
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
