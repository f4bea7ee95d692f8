import { Code, ConnectError, createRouterTransport } from '@connectrpc/connect';
import { expect, test } from 'vitest';
import { createHypermapClient } from './client.js';
import { AccessService, Role } from './gen/hypermap/v1/access_service_pb.js';

/** A server on which the token "secret" is Anna's. It counts its calls. */
function serverOfAnna() {
  const calls = { count: 0 };
  const transport = createRouterTransport(({ service }) => {
    service(AccessService, {
      getCaller(_, { requestHeader }) {
        calls.count++;
        if (requestHeader.get('Authorization') !== 'Bearer secret') {
          throw new ConnectError('the token is not known', Code.Unauthenticated);
        }
        return { hasIdentities: true, identity: 'anna', role: Role.EDITOR, maps: ['*'] };
      },
    });
  });
  return { transport, calls };
}

test('a caller learns who it is to the server', async () => {
  const { access } = createHypermapClient(serverOfAnna().transport, { token: 'secret' });
  expect(await access.getCaller({})).toMatchObject({ identity: 'anna', role: Role.EDITOR });
});

test('a caller that is not known is told at once', async () => {
  const { transport, calls } = serverOfAnna();
  await expect(createHypermapClient(transport).access.getCaller({})).rejects.toMatchObject({
    code: Code.Unauthenticated,
  });
  expect(calls.count).toBe(1);
});
