import { Code, ConnectError } from '@connectrpc/connect';

// What the server will answer in the same way again.
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

/** Whether a stream that ended so is worth opening again. */
export function isTransient(error: unknown): boolean {
  return !final.has(ConnectError.from(error).code);
}

// The server was not reached, or what it said was not understood whole. Browsers tell of a lost
// connection by a plain error, which the library wraps.
function isUnreachable(error: unknown): boolean {
  const { code, cause } = ConnectError.from(error);
  return code === Code.Unavailable || (cause !== undefined && code !== Code.Canceled);
}

export interface BackoffOptions {
  /** Milliseconds before the first new try. Default 200. */
  firstMs?: number;
  /** The longest wait. Default 5000. */
  longestMs?: number;
}

/** Waits that grow twofold, each cut by up to a half at random so that clients don't come at once. */
export class Backoff {
  private readonly firstMs: number;
  private readonly longestMs: number;
  private tries = 0;

  constructor({ firstMs = 200, longestMs = 5000 }: BackoffOptions = {}) {
    this.firstMs = firstMs;
    this.longestMs = longestMs;
  }

  reset(): void {
    this.tries = 0;
  }

  /** The next wait, in milliseconds. */
  next(): number {
    const whole = Math.min(this.longestMs, this.firstMs * 2 ** Math.min(this.tries++, 30));
    return whole * (1 - Math.random() / 2);
  }
}

/** Ends early, without an error, when the signal is aborted. */
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

export async function retrying<T>(
  call: () => Promise<T>,
  { retries, signal }: { retries: number; signal?: AbortSignal | undefined },
): Promise<T> {
  const backoff = new Backoff();
  for (let left = retries; ; --left) {
    try {
      return await call();
    } catch (error) {
      if (left <= 0 || signal?.aborted || !isUnreachable(error)) throw error;
    }
    await wait(backoff.next(), signal);
  }
}
