// The connection to the server and its status.
import {
  Code,
  ConnectError,
  createHypermapClient,
  isTransient,
  type HypermapClient,
} from '@hypermap/client';
import { computed, signal } from '@preact/signals';

export type Status = 'connecting' | 'live' | 'disconnected' | 'error';

/** The status of the watch, which stands for the connection because it is always open. */
export const status = signal<Status>('connecting');
/** A message for the user about the last failure. Undefined while there is none. */
export const problem = signal<string>();
/** Whether the server does not know the user, or not any more. */
export const signInWanted = signal(false);

const attempts = signal(0);

/**
 * The client for all calls, which the browser sends with the cookie of its session. `tryAgain`
 * replaces it.
 */
export const client = computed<HypermapClient>(() => {
  attempts.value;
  // A person wants to know soon that the server can't be reached.
  return createHypermapClient(location.origin, { retryForMs: 2000 });
});

/** Clears the error and reconnects with a new client. */
export function tryAgain(): void {
  signInWanted.value = false;
  problem.value = undefined;
  status.value = 'connecting';
  attempts.value++;
}

// Errors that an operator looks up in the server's log.
const faults = new Set<Code>([Code.Internal, Code.Unknown, Code.DataLoss]);

/**
 * The message of an error, without its code in brackets. That of a fault of the server tells the
 * name of the call in the server's log.
 */
export function messageOf(error: unknown): string {
  const { code, metadata, rawMessage } = ConnectError.from(error);
  const call = faults.has(code) ? metadata.get('x-request-id') : null;
  return call ? `${rawMessage} (call ${call} in the server's log)` : rawMessage;
}

export function noteAlive(): void {
  status.value = 'live';
  problem.value = undefined;
}

/** Records a failed call: "disconnected" if a retry may succeed, otherwise "error". */
export function noteFailure(error: unknown): void {
  signInWanted.value = ConnectError.from(error).code === Code.Unauthenticated;
  problem.value = messageOf(error);
  status.value = isTransient(error) ? 'disconnected' : 'error';
}
