// Signing in and out, at a gateway that accepts the token "right".
import { Code, ConnectError } from '@hypermap/client';
import { afterEach, beforeEach, expect, test, vi } from 'vitest';

const reload = vi.hoisted(() => {
  const reload = vi.fn<() => void>();
  vi.stubGlobal('location', { origin: 'http://127.0.0.1', reload });
  return reload;
});

const { client, noteFailure, signInWanted, status } = await import('./connection');
const { sessionProblem, signIn, signOut, signing } = await import('./session');

const requests: [path: string, init: RequestInit][] = [];

function gateway(path: string, init: RequestInit): Promise<Response> {
  requests.push([path, init]);
  const isRefused = init.method === 'POST' && init.body !== '{"token":"right"}';
  return Promise.resolve(
    isRefused
      ? new Response('the token is not known, or has expired\n', { status: 401 })
      : new Response(null, { status: 204 }),
  );
}

beforeEach(() => {
  requests.length = 0;
  vi.stubGlobal('fetch', gateway);
  noteFailure(new ConnectError('a token is needed', Code.Unauthenticated));
});
afterEach(() => {
  reload.mockClear();
});

test('the token goes to the gateway as JSON, and the page reconnects', async () => {
  const before = client.value;
  expect(signInWanted.value).toBe(true);
  const done = signIn('right');
  expect(signing.value).toBe(true);
  await done;
  expect(requests).toEqual([
    [
      '/session',
      {
        method: 'POST',
        headers: { 'Content-Type': 'application/json' },
        body: '{"token":"right"}',
      },
    ],
  ]);
  expect(signing.value).toBe(false);
  expect(signInWanted.value).toBe(false);
  expect(status.value).toBe('connecting');
  expect(client.value).not.toBe(before);
});

test('a wrong token is told, and another one can be tried', async () => {
  await signIn('wrong');
  expect(sessionProblem.value).toBe('the token is not known, or has expired');
  expect(signInWanted.value).toBe(true);
  await signIn('right');
  expect(sessionProblem.value).toBeUndefined();
  expect(signInWanted.value).toBe(false);
});

test('signing out loads the page anew', async () => {
  await signOut();
  expect(requests).toEqual([['/session', { method: 'DELETE' }]]);
  expect(reload).toHaveBeenCalledOnce();
});

test('a gateway that is gone signs nobody out', async () => {
  vi.stubGlobal('fetch', () => Promise.reject(new TypeError('Failed to fetch')));
  await signOut();
  expect(reload).not.toHaveBeenCalled();
  expect(sessionProblem.value).toBe("The gateway can't be reached.");
});
