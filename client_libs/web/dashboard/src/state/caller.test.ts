// What the page offers to callers of each role.
import { GetCallerResponseSchema, Role, create, type HypermapClient } from '@hypermap/client';
import { expect, test, vi } from 'vitest';

const RPCS = [
  { rpc: 'hypermap.v1.CatalogService/BackupMap', least: Role.ADMIN },
  { rpc: 'hypermap.v1.EditService/ApplyEdits', least: Role.EDITOR },
];

/** The answer of the server. Undefined for a server that is too old to have one. */
let answer: { hasIdentities: boolean; role?: Role } | undefined;

function fakeClient(): HypermapClient {
  const getCaller = () =>
    answer
      ? Promise.resolve(create(GetCallerResponseSchema, { rpcs: RPCS, ...answer }))
      : Promise.reject(new Error('unimplemented'));
  return { access: { getCaller } } as unknown as HypermapClient;
}

vi.mock('@hypermap/client', async (original) => ({
  ...(await original<object>()),
  createHypermapClient: fakeClient,
}));
vi.hoisted(() => vi.stubGlobal('location', { origin: 'http://127.0.0.1' }));

const { caller, may, startCaller } = await import('./caller');
const { noteAlive, tryAgain } = await import('./connection');

startCaller();

/** Connects to a server that answers so. */
async function connect(to: typeof answer): Promise<void> {
  answer = to;
  caller.value = undefined;
  tryAgain();
  noteAlive();
  await vi.waitFor(() => expect(caller.value !== undefined).toBe(to !== undefined));
}

test('a role may do what needs at most that role', async () => {
  const allowed = [
    [Role.READER, false, false],
    [Role.ROBOT, false, false],
    [Role.EDITOR, true, false],
    [Role.ADMIN, true, true],
  ] as const;
  for (const [role, edits, backups] of allowed) {
    await connect({ hasIdentities: true, role });
    expect(may('EditService/ApplyEdits')).toBe(edits);
    expect(may('CatalogService/BackupMap')).toBe(backups);
  }
});

test('a server that knows no identities, or does not tell, forbids nothing', async () => {
  for (const to of [{ hasIdentities: false }, undefined]) {
    await connect(to);
    expect(may('EditService/ApplyEdits')).toBe(true);
    expect(may('CatalogService/BackupMap')).toBe(true);
  }
});
