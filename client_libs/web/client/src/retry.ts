import { Code, ConnectError } from '@connectrpc/connect';

// Codes that a retry would get again.
const final = new Set<Code>([
  Code.InvalidArgument,
  Code.NotFound,
  Code.AlreadyExists,
  Code.PermissionDenied,
  Code.Unauthenticated,
  Code.FailedPrecondition,
  Code.OutOfRange,
  Code.Unimplemented,
  Code.DataLoss,
]);

/** Whether a stream that ended with this error may succeed when it is opened again. */
export function isTransient(error: unknown): boolean {
  return !final.has(ConnectError.from(error).code);
}

// Whether the server could not be reached or its answer was cut off. Browsers report a lost
// connection as a plain error, which Connect wraps as the cause.
function isUnreachable(error: unknown): boolean {
  const { code, cause } = ConnectError.from(error);
  return code === Code.Unavailable || (cause !== undefined && code !== Code.Canceled);
}

// A caller would not expect a call to wait for longer.
const longestPauseMs = 30_000;

/**
 * The wait that a server which is full asks for (gRFC A6), milliseconds; undefined without one, or
 * if it is too long to wait for.
 */
function askedPause(error: unknown): number | undefined {
  const { code, metadata } = ConnectError.from(error);
  const told = code === Code.ResourceExhausted ? metadata.get('grpc-retry-pushback-ms') : null;
  if (told === null || !/^\d+$/.test(told)) return undefined;
  return Number(told) <= longestPauseMs ? Number(told) : undefined;
}

export interface BackoffOptions {
  /** The delay before the first retry, milliseconds. Default 200. */
  firstMs?: number;
  /** The maximum delay, milliseconds. Default 5000. */
  longestMs?: number;
}

/**
 * Exponential backoff. Each delay is reduced at random by up to a half, so that clients do not
 * retry all at once.
 */
export class Backoff {
  private readonly firstMs: number;
  private readonly longestMs: number;
  private tries = 0;

  constructor({ firstMs = 200, longestMs = 5000 }: BackoffOptions = {}) {
    this.firstMs = firstMs;
    this.longestMs = longestMs;
  }

  /** Starts again with the first delay. */
  reset(): void {
    this.tries = 0;
  }

  /** Returns the next delay, milliseconds. */
  next(): number {
    const whole = Math.min(this.longestMs, this.firstMs * 2 ** Math.min(this.tries++, 30));
    return whole * (1 - Math.random() / 2);
  }
}

/** Waits for a time. Resolves early, without an error, when the signal is aborted. */
export function wait(ms: number, signal?: AbortSignal): Promise<void> {
  if (signal?.aborted) return Promise.resolve();
  return new Promise((resolve) => {
    const end = () => {
      clearTimeout(timer);
      signal?.removeEventListener('abort', end);
      resolve();
    };
    const timer = setTimeout(end, ms);
    signal?.addEventListener('abort', end);
  });
}

export interface RetryOptions {
  /** The maximum number of retries. */
  retries: number;
  /** The time within which the last retry begins, milliseconds. */
  retryForMs: number;
  signal?: AbortSignal | undefined;
}

/**
 * Calls a function, and again with a backoff while the server is unreachable, or after the wait that
 * a server which is full asks for.
 */
export async function retrying<T>(
  call: () => Promise<T>,
  { retries, retryForMs, signal }: RetryOptions,
): Promise<T> {
  const until = Date.now() + retryForMs;
  const backoff = new Backoff({ firstMs: 50, longestMs: 2000 });
  for (let left = retries; ; --left) {
    let pause: number | undefined;
    try {
      return await call();
    } catch (error) {
      pause = isUnreachable(error) ? backoff.next() : askedPause(error);
      if (left <= 0 || signal?.aborted || pause === undefined) throw error;
      if (Date.now() + pause >= until) throw error;
    }
    await wait(pause, signal);
  }
}
