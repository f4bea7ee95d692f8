import type { DescMessage, DescMethodUnary, MessageInitShape } from '@bufbuild/protobuf';
import type { Transport } from '@connectrpc/connect';
import { newRequestId } from './request_id.js';
import { retrying } from './retry.js';

export interface GuardOptions {
  /** The bearer token of each call. A function is called before each call. */
  token?: string | (() => string | undefined);
  /** The maximum number of retries of a call. Default: no limit but `retryForMs`. */
  retries?: number;
  /**
   * The time for which a call is retried while the server is unreachable or full, milliseconds.
   * Default 30000, in which another server takes over the maps of one that has died.
   */
  retryForMs?: number;
}

/** Wraps a transport so that calls get tokens, request ids and retries. */
export function guard(
  transport: Transport,
  { token, retries = Infinity, retryForMs = 30_000 }: GuardOptions,
): Transport {
  const withToken = (given: HeadersInit | undefined): Headers => {
    const header = new Headers(given);
    const now = typeof token === 'function' ? token() : token;
    if (now) header.set('Authorization', `Bearer ${now}`);
    return header;
  };
  return {
    unary(method, signal, timeoutMs, header, input, contextValues) {
      const message = withRequestId(method.input, input);
      const send = () =>
        transport.unary(method, signal, timeoutMs, withToken(header), message, contextValues);
      return isIdempotent(method) ? retrying(send, { retries, retryForMs, signal }) : send();
    },
    stream(method, signal, timeoutMs, header, input, contextValues) {
      return transport.stream(method, signal, timeoutMs, withToken(header), input, contextValues);
    },
  };
}

function withRequestId<I extends DescMessage>(
  schema: I,
  input: MessageInitShape<I>,
): MessageInitShape<I> {
  const given = input as { requestId?: string };
  if (!schema.field['requestId'] || given.requestId) return input;
  return { ...input, requestId: newRequestId() };
}

// A call with a request id is idempotent, because the server repeats its first answer. Queries
// change nothing.
function isIdempotent(method: DescMethodUnary): boolean {
  return (
    Boolean(method.input.field['requestId']) ||
    /^(Get|List|Query|Explain|Estimate)/.test(method.name)
  );
}
