import { createConnectTransport, createGrpcWebTransport } from '@connectrpc/connect-web';
import { createGrpcTransport } from '@connectrpc/connect-node';
import type { Transport } from '@connectrpc/connect';
import { execFile } from 'node:child_process';
import { mkdtemp, rm, writeFile } from 'node:fs/promises';
import { tmpdir } from 'node:os';
import { join } from 'node:path';
import { promisify } from 'node:util';
import { afterAll, beforeAll, describe, expect, test } from 'vitest';
import { root } from '../../e2e/support/places.js';
import { Server } from '../../e2e/support/programs.js';
import { createHypermapClient, watch } from './index.js';

const map = 'authors';

let folder: string;
let server: Server;
let gateway: Server;

/** Decompresses a file of a map of version 0.1 whose log has authors that are no UTF-8. */
async function oldMap(): Promise<Buffer> {
  const file = `${root}tests/integration/testdata/v0_1/authors.gpkg.xz`;
  const options = { encoding: 'buffer' as const, maxBuffer: 64 << 20 };
  return (await promisify(execFile)('xz', ['--decompress', '--stdout', file], options)).stdout;
}

beforeAll(async () => {
  folder = await mkdtemp(join(tmpdir(), 'hypermap_authors_'));
  await writeFile(join(folder, `${map}.gpkg`), await oldMap());
  server = await Server.start('hypermapd', [
    `--data_dir=${folder}`,
    '--listen=127.0.0.1:0',
    // The map is old, and all of its history is to be read.
    '--history_age=876000h',
    '--history_revisions=1000000000',
  ]);
  gateway = await Server.start('hypermap-gateway', [
    `--server=${server.address}`,
    '--listen=127.0.0.1:0',
  ]);
});

afterAll(async () => {
  await Promise.all([gateway?.stop(), server?.stop()]);
  await rm(folder, { recursive: true, force: true });
});

/**
 * Checks the authors of the last three revisions in order: two bytes that are no UTF-8, a name that
 * version 0.1 cut to 128 bytes, and an honest one.
 */
function check(authors: string[]): void {
  expect(authors.slice(-3)).toEqual(['\u{FFFD}\u{FFFD}', 'é'.repeat(64), 'an honest name']);
}

const transports: Record<string, () => Transport> = {
  'gRPC to the server': () => createGrpcTransport({ baseUrl: `http://${server.address}` }),
  'Connect with JSON through the gateway': () =>
    createConnectTransport({ baseUrl: gateway.address }),
  'gRPC-Web through the gateway': () => createGrpcWebTransport({ baseUrl: gateway.address }),
};

describe.each(Object.entries(transports))('by %s', (_, transport) => {
  test('A3 the list of revisions and a watch have the authors', async () => {
    const client = createHypermapClient(transport());
    const { revisions } = await client.changes.listRevisions({ map });
    const authors = revisions.map(({ author }) => author);
    check(authors);

    const watched: string[] = [];
    for await (const event of watch(client, { scope: { map }, startRevision: 0n })) {
      watched.push(event.author);
      if (watched.length === authors.length) break;
    }
    expect(watched).toEqual(authors);
  });
});
