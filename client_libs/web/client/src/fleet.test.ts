// Two servers that share a PostgreSQL database, behind a gateway that knows both; skipped if
// PostgreSQL is missing.
import { type ChildProcess, execFileSync, spawn } from 'node:child_process';
import { once } from 'node:events';
import { mkdtemp, rm } from 'node:fs/promises';
import { tmpdir } from 'node:os';
import { join, resolve } from 'node:path';
import { createInterface } from 'node:readline';
import { afterAll, beforeAll, expect, test } from 'vitest';
import { Server } from '../../e2e/support/programs.js';
import { createHypermapClient, LayerKind, newRequestId, watch } from './index.js';

const withCluster = resolve(import.meta.dirname, '../../../../tests/postgres/with_cluster.sh');

let cluster: ChildProcess | undefined;
let folder: string;
let servers: Server[] = [];

/** The URI of a PostgreSQL cluster, empty if there is none. */
async function startCluster(): Promise<string> {
  const given = process.env['HYPERMAP_TEST_POSTGRES'];
  if (given) return given;
  // The script ends the cluster when `cat` sees the end of its input.
  const command = ['bash', '-c', 'echo $HYPERMAP_TEST_POSTGRES; cat'];
  const child = spawn(withCluster, command, { stdio: ['pipe', 'pipe', 'inherit'] });
  cluster = child;
  for await (const line of createInterface({ input: child.stdout })) return line;
  return '';
}

beforeAll(async () => {
  folder = await mkdtemp(join(tmpdir(), 'hypermap_fleet_'));
  const uri = await startCluster();
  if (uri === '') return;
  const database = `web_${newRequestId()}`;
  const create = `CREATE DATABASE ${database} STRATEGY FILE_COPY`;
  execFileSync('psql', ['-qAtX', '-d', `${uri}/postgres`, '-c', create]);
  const start = (id: string) =>
    Server.start('hypermapd', [
      `--data_dir=${join(folder, id)}`,
      `--store=${uri}/${database}`,
      `--server_id=${id}`,
      '--listen=127.0.0.1:0',
    ]);
  servers = [await start('a'), await start('b')];
}, 60_000);

afterAll(async () => {
  await Promise.all(servers.map((server) => server.stop('SIGKILL')));
  if (cluster && cluster.exitCode === null) {
    const gone = once(cluster, 'exit');
    cluster.stdin?.end();
    await gone;
  }
  await rm(folder, { recursive: true, force: true });
}, 60_000);

test('edits and a watch go on when the server behind the gateway is killed', async (context) => {
  const [first, second] = servers;
  if (!first || !second) return context.skip('PostgreSQL is missing');
  const gateway = await Server.start('hypermap-gateway', [
    `--server=${first.address},${second.address}`,
    '--listen=127.0.0.1:0',
    `--dashboard=${folder}`,
  ]);
  servers.push(gateway);
  const client = createHypermapClient(gateway.address);
  await client.catalog.createMap({ map: 'site' });
  await client.catalog.createLayer({
    map: 'site',
    layer: { name: 'things', kind: LayerKind.SEMANTIC },
  });
  const last = 31n;
  const told: bigint[] = [];
  const following = (async () => {
    const request = { scope: { map: 'site' }, startRevision: 0n };
    for await (const event of watch(client, request)) {
      if (event.changes.length > 0) told.push(event.revision);
      if (event.revision >= last) return;
    }
  })();
  const point = { shape: { case: 'point' as const, value: { x: 1, y: 2 } } };
  let killed: Promise<void> | undefined;
  const revisions: bigint[] = [];
  for (let i = 2n; i <= last; ++i) {
    if (i === 12n) killed = first.stop('SIGKILL'); // while edits are under way
    const object = { label: `cup ${i}`, shape: point };
    const { revision } = await client.edit.applyEdits({
      map: 'site',
      edits: [{ edit: { case: 'putObject', value: { layer: 'things', object } } }],
    });
    revisions.push(revision);
  }
  await killed;
  await following;
  const all = Array.from({ length: Number(last) }, (_, i) => BigInt(i + 1));
  expect(revisions).toEqual(all.slice(1));
  expect(told).toEqual(all);
}, 90_000);
