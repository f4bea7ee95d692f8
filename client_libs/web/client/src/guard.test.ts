import { Code, ConnectError, createRouterTransport } from '@connectrpc/connect';
import { expect, test } from 'vitest';
import { createHypermapClient } from './client.js';
import { CatalogService } from './gen/hypermap/v1/catalog_service_pb.js';
import { EditService } from './gen/hypermap/v1/edit_service_pb.js';
import { ExplorationService } from './gen/hypermap/v1/exploration_service_pb.js';
import { QueryService } from './gen/hypermap/v1/query_service_pb.js';

/** A server that fails the first `times` calls, and the request ids and tokens that it received. */
function failing(times: number, code: Code, metadata?: Record<string, string>) {
  const ids: string[] = [];
  const tokens: (string | null)[] = [];
  const fail = () => {
    if (times-- > 0) throw new ConnectError('not now', code, metadata);
  };
  const transport = createRouterTransport(({ service }) => {
    service(EditService, {
      applyEdits(request, { requestHeader }) {
        ids.push(request.requestId);
        tokens.push(requestHeader.get('Authorization'));
        fail();
        return { revision: 1n };
      },
    });
    service(CatalogService, {
      listMaps() {
        ids.push('');
        fail();
        return {};
      },
    });
    service(QueryService, {
      estimateTransform() {
        ids.push('');
        fail();
        return {};
      },
    });
    service(ExplorationService, {
      renewGoal() {
        ids.push('');
        fail();
        return {};
      },
    });
  });
  return { transport, ids, tokens };
}

test('a mutation is retried with the same request id while the server is unreachable', async () => {
  const { transport, ids } = failing(2, Code.Unavailable);
  const { revision } = await createHypermapClient(transport).edit.applyEdits({ map: 'm' });
  expect(revision).toBe(1n);
  expect(ids).toHaveLength(3);
  expect(new Set(ids).size).toBe(1);
  expect(ids[0]).toMatch(/^[0-9a-f]{32}$/);
});

test('two mutations get different request ids, and a given id is kept', async () => {
  const { transport, ids } = failing(0, Code.Unavailable);
  const { edit } = createHypermapClient(transport);
  await edit.applyEdits({ map: 'm' });
  await edit.applyEdits({ map: 'm' });
  await edit.applyEdits({ map: 'm', requestId: 'mine' });
  expect(new Set(ids).size).toBe(3);
  expect(ids[2]).toBe('mine');
});

test('queries are retried; refused calls and calls that are not idempotent are not', async () => {
  const question = failing(1, Code.Unavailable);
  await createHypermapClient(question.transport).catalog.listMaps({});
  expect(question.ids).toHaveLength(2);

  const estimate = failing(1, Code.Unavailable);
  await createHypermapClient(estimate.transport).query.estimateTransform({});
  expect(estimate.ids).toHaveLength(2);

  const refused = failing(1, Code.Aborted);
  await expect(createHypermapClient(refused.transport).edit.applyEdits({})).rejects.toMatchObject({
    code: Code.Aborted,
  });
  expect(refused.ids).toHaveLength(1);

  const unguarded = failing(1, Code.Unavailable);
  await expect(
    createHypermapClient(unguarded.transport).exploration.renewGoal({}),
  ).rejects.toMatchObject({ code: Code.Unavailable });
  expect(unguarded.ids).toHaveLength(1);
});

test('a call is retried when a full server asks for it, and only then', async () => {
  const full = failing(2, Code.ResourceExhausted, { 'grpc-retry-pushback-ms': '20' });
  await createHypermapClient(full.transport).edit.applyEdits({});
  expect(full.ids).toHaveLength(3);

  for (const told of [undefined, '-1', 'soon', '30001']) {
    const metadata = told === undefined ? undefined : { 'grpc-retry-pushback-ms': told };
    const never = failing(1, Code.ResourceExhausted, metadata);
    await expect(createHypermapClient(never.transport).edit.applyEdits({})).rejects.toMatchObject({
      code: Code.ResourceExhausted,
    });
    expect(never.ids).toHaveLength(1);
  }
});

test('gives up after the given number of retries, or when the call is aborted', async () => {
  const { transport, ids } = failing(9, Code.Unavailable);
  await expect(
    createHypermapClient(transport, { retries: 1 }).edit.applyEdits({}),
  ).rejects.toMatchObject({ code: Code.Unavailable });
  expect(ids).toHaveLength(2);
  await expect(
    createHypermapClient(transport).edit.applyEdits({}, { signal: AbortSignal.abort() }),
  ).rejects.toMatchObject({ code: Code.Canceled });
  expect(ids.length).toBeLessThanOrEqual(3);
});

test('gives up when the time for retries is over', async () => {
  const { transport, ids } = failing(99, Code.Unavailable);
  await expect(
    createHypermapClient(transport, { retryForMs: 200 }).edit.applyEdits({}),
  ).rejects.toMatchObject({ code: Code.Unavailable });
  expect(ids.length).toBeGreaterThan(1);
  expect(ids.length).toBeLessThan(9);
});

test('each call is sent with the current token', async () => {
  const { transport, tokens } = failing(0, Code.Unavailable);
  let token: string | undefined = 'first';
  const { edit } = createHypermapClient(transport, { token: () => token });
  await edit.applyEdits({});
  token = undefined;
  await edit.applyEdits({});
  await createHypermapClient(transport, { token: 'fixed' }).edit.applyEdits({});
  expect(tokens).toEqual(['Bearer first', null, 'Bearer fixed']);
});
