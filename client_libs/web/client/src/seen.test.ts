import { create } from '@bufbuild/protobuf';
import { createRouterTransport } from '@connectrpc/connect';
import { expect, test } from 'vitest';
import { createHypermapClient } from './client.js';
import { CatalogService } from './gen/hypermap/v1/catalog_service_pb.js';
import { EditService } from './gen/hypermap/v1/edit_service_pb.js';
import {
  EstimateTransformRequestSchema,
  QueryPointRequestSchema,
  QueryService,
  type EstimateTransformRequest,
} from './gen/hypermap/v1/query_service_pb.js';
import type { AsOf } from './gen/hypermap/v1/scope_pb.js';
import { WatchService } from './gen/hypermap/v1/watch_service_pb.js';
import { watch } from './watch.js';

/** A server that answers with the newest of `revisions`, and what its queries said they had seen. */
function revisions(...answers: [revision: bigint, incarnation: bigint][]) {
  const asked: (AsOf | undefined)[] = [];
  const next = () => {
    const [revision, incarnation] = answers.shift() ?? [0n, 0n];
    return { revision, incarnation };
  };
  const transport = createRouterTransport(({ service }) => {
    service(CatalogService, { listLayers: () => next() });
    service(EditService, { applyEdits: () => next() });
    service(QueryService, {
      queryPoint(request) {
        asked.push(request.asOf);
        return next();
      },
      async *queryArea(request) {
        asked.push(request.asOf);
        yield next();
      },
    });
    service(WatchService, {
      async *watch() {
        yield { ...next(), snapshot: true };
      },
    });
  });
  const seen = () => asked.map((asOf) => asOf && [asOf.seenRevision, asOf.seenIncarnation]);
  return { client: createHypermapClient(transport), seen, asked };
}

const scope = { map: 'office' };

test('a query names the newest revision of its map that the client has seen', async () => {
  const { client, seen } = revisions([7n, 1n], [9n, 1n], [8n, 1n], [3n, 1n], [9n, 1n]);
  await client.edit.applyEdits({ map: 'office' });
  await client.query.queryPoint({ scope });
  for await (const part of client.query.queryArea({ scope })) expect(part.revision).toBe(8n);
  await client.query.queryPoint({ scope: { map: 'attic' } });
  await client.query.queryPoint({ scope });
  expect(seen()).toEqual([[7n, 1n], [9n, 1n], undefined, [9n, 1n]]);
});

test('a request about two maps names what the client has seen of each', async () => {
  const asked: EstimateTransformRequest[] = [];
  const client = createHypermapClient(
    createRouterTransport(({ service }) => {
      service(QueryService, {
        estimateTransform(request) {
          asked.push(request);
          return {
            source: { map: 'attic', revision: 3n, incarnation: 8n },
            target: { map: 'office', revision: 12n, incarnation: 9n },
          };
        },
      });
    }),
  );
  const source = { scope: { map: 'attic' } };
  const target = { scope: { map: 'office' }, asOf: { minRevision: 5n } };
  await client.query.estimateTransform({ source, target });
  await client.query.estimateTransform({ source, target });
  await client.query.estimateTransform(
    create(EstimateTransformRequestSchema, { source: target, target: source }),
  );
  const seen = asked.map(({ source, target }) => [
    source?.asOf?.seenRevision,
    target?.asOf?.seenRevision,
    target?.asOf?.minRevision,
  ]);
  expect(seen).toEqual([
    [undefined, 0n, 5n],
    [3n, 12n, 5n],
    [12n, 3n, 0n],
  ]);
  expect(asked[1]?.target?.asOf?.seenIncarnation).toBe(9n);
});

test('a query names what a watch has told', async () => {
  const { client, seen } = revisions([5n, 1n], [5n, 1n]);
  for await (const event of watch(client, { scope })) {
    expect(event.revision).toBe(5n);
    break;
  }
  await client.query.queryPoint({ scope });
  expect(seen()).toEqual([[5n, 1n]]);
});

test('an answer without as_of that is older than what was seen is asked for again', async () => {
  const { client } = revisions([7n, 1n], [6n, 1n], [7n, 1n]);
  await client.edit.applyEdits({ map: 'office' });
  expect((await client.catalog.listLayers({ map: 'office' })).revision).toBe(7n);
});

test('the answer to a mutation may be old', async () => {
  const { client } = revisions([7n, 1n], [6n, 1n]);
  await client.edit.applyEdits({ map: 'office' });
  expect((await client.edit.applyEdits({ map: 'office' })).revision).toBe(6n);
});

test('the revision of another incarnation begins anew', async () => {
  const { client, seen } = revisions([7n, 1n], [2n, 4n], [2n, 4n]);
  await client.query.queryPoint({ scope });
  await client.query.queryPoint({ scope });
  await client.query.queryPoint({ scope });
  expect(seen()).toEqual([undefined, [7n, 1n], [2n, 4n]]);
});

test('the revision that a query selects is kept', async () => {
  const { client, asked } = revisions([7n, 1n], [4n, 1n], [4n, 1n]);
  await client.query.queryPoint({ scope });
  const question = { scope, asOf: { asOf: { case: 'atRevision' as const, value: 4n } } };
  await client.query.queryPoint(question);
  await client.query.queryPoint(create(QueryPointRequestSchema, question));
  const expected = { seenRevision: 7n, asOf: { case: 'atRevision', value: 4n } };
  expect(asked.slice(1)).toMatchObject([expected, expected]);
});
