import { create, type DescMessage, type MessageInitShape } from '@bufbuild/protobuf';
import { Code, ConnectError, type Transport } from '@connectrpc/connect';
import { AsOfSchema } from './gen/hypermap/v1/scope_pb.js';

// The fields of requests and answers that matter here. Some messages have none of them.
interface Request {
  map?: string;
  scope?: { map?: string };
  asOf?: MessageInitShape<typeof AsOfSchema>;
}
interface Revision {
  revision?: bigint | undefined;
  incarnation?: bigint | undefined;
}
interface Answer extends Revision {
  newestRevision?: bigint;
  map?: string | Revision;
  source?: Side;
  target?: Side;
}
// What was read of one of two maps.
interface Side extends Revision {
  map?: string;
}

/**
 * Wraps a transport so that a client sees its own changes, and never goes back in time, whichever of
 * several servers it asks: each query carries the newest revision of its map that an answer or a
 * watch has named, and no server answers it with less. Other questions fail with UNAVAILABLE if their
 * answer is of an earlier revision, so that they are asked again.
 */
export function monotonic(transport: Transport): Transport {
  const maps = new Map<string, { revision: bigint; incarnation: bigint }>();

  const withSeen = <I extends DescMessage>(
    schema: I,
    input: MessageInitShape<I>,
  ): MessageInitShape<I> => {
    if (!schema.field['asOf']) return withSides(schema, input);
    const seen = maps.get(mapOf(input));
    if (!seen) return input;
    // A message, because the input may be one, whose fields must be messages, too.
    const asOf = create(AsOfSchema, {
      ...(input as Request).asOf,
      seenRevision: seen.revision,
      seenIncarnation: seen.incarnation,
    });
    return { ...input, asOf };
  };
  // A request that compares two maps has an asOf for each.
  const withSides = <I extends DescMessage>(
    schema: I,
    input: MessageInitShape<I>,
  ): MessageInitShape<I> => {
    let sent = input;
    for (const side of ['source', 'target'] as const) {
      const inner = schema.field[side]?.message;
      const given = (input as Record<string, unknown>)[side];
      if (!inner?.field['asOf'] || !given) continue;
      sent = {
        ...sent,
        [side]: create(inner, withSeen(inner, given as MessageInitShape<typeof inner>)),
      };
    }
    return sent;
  };
  const note = (map: string, { revision, incarnation }: Revision) => {
    if (map === '' || revision === undefined || !incarnation) return;
    const seen = maps.get(map);
    // Another incarnation begins anew, even with a smaller revision.
    if (seen?.incarnation === incarnation && seen.revision >= revision) return;
    maps.set(map, { revision, incarnation });
  };
  return {
    async unary(method, signal, timeoutMs, header, input, contextValues) {
      const map = mapOf(input);
      const seen = maps.get(map);
      const sent = withSeen(method.input, input);
      const answer = await transport.unary(method, signal, timeoutMs, header, sent, contextValues);
      const newest = newestIn(answer.message as Answer);
      // A mutation that is repeated gets its old answer.
      const { requestId, asOf } = method.input.field;
      if (!requestId && !asOf && isBefore(newest, seen)) {
        throw new ConnectError('the server has an earlier revision than seen', Code.Unavailable);
      }
      note(map, newest);
      const { source, target } = answer.message as Answer;
      for (const side of [source, target]) if (side?.map) note(side.map, side);
      return answer;
    },
    async stream(method, signal, timeoutMs, header, input, contextValues) {
      let map = '';
      const sent = each(input, (message) => {
        map ||= mapOf(message);
        return withSeen(method.input, message);
      });
      const answer = await transport.stream(method, signal, timeoutMs, header, sent, contextValues);
      const message = each(answer.message, (part) => {
        note(map, part as Answer);
        return part;
      });
      return { ...answer, message };
    },
  };
}

// The newest revision at which an answer was read.
function newestIn({ newestRevision, revision, incarnation, map }: Answer): Revision {
  if (typeof map === 'object') return map;
  return { revision: newestRevision ?? revision, incarnation };
}

function isBefore({ revision, incarnation }: Revision, seen: Revision | undefined): boolean {
  if (revision === undefined || seen?.revision === undefined) return false;
  return incarnation === seen.incarnation && revision < seen.revision;
}

function mapOf(request: unknown): string {
  const { map, scope } = request as Request;
  return scope?.map ?? map ?? '';
}

async function* each<T>(items: AsyncIterable<T>, change: (item: T) => T): AsyncGenerator<T> {
  for await (const item of items) yield change(item);
}
