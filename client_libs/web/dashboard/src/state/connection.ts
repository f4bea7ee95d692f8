// The server, and how we stand with it.
import {
  Code,
  ConnectError,
  createHypermapClient,
  isTransient,
  type HypermapClient,
} from '@hypermap/client';
import { computed, signal } from '@preact/signals';

export type Status = 'connecting' | 'live' | 'disconnected' | 'error';

/** Of the watch, which is open all the time. */
export const status = signal<Status>('connecting');
/** What is wrong, for people. Undefined while nothing is. */
export const problem = signal<string>();
/** Whether the server wants another token than it got. */
export const tokenWanted = signal(false);

const TOKEN_KEY = 'hypermap.token';

function connect(): HypermapClient {
  const token = sessionStorage.getItem(TOKEN_KEY);
  return createHypermapClient(location.origin, token ? { token } : {});
}

const attempts = signal(0);

/** The client for all calls. Another one after `tryAgain`. */
export const client = computed(() => {
  attempts.value;
  return connect();
});

/** The token lives as long as the browser's tab. */
export function giveToken(token: string): void {
  sessionStorage.setItem(TOKEN_KEY, token);
  tryAgain();
}

/** Begins anew after an error. */
export function tryAgain(): void {
  tokenWanted.value = false;
  problem.value = undefined;
  status.value = 'connecting';
  attempts.value++;
}

/** What an error says, without its code in brackets. */
export function messageOf(error: unknown): string {
  return ConnectError.from(error).rawMessage;
}

export function noteAlive(): void {
  status.value = 'live';
  problem.value = undefined;
}

/** Takes note of a failed call, which may be mended by itself or not. */
export function noteFailure(error: unknown): void {
  tokenWanted.value = ConnectError.from(error).code === Code.Unauthenticated;
  problem.value = messageOf(error);
  status.value = isTransient(error) ? 'disconnected' : 'error';
}
