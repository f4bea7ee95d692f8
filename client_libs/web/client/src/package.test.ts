import { execFile } from 'node:child_process';
import { mkdir, mkdtemp, readdir, rm, symlink, writeFile } from 'node:fs/promises';
import { tmpdir } from 'node:os';
import { join } from 'node:path';
import { fileURLToPath } from 'node:url';
import { promisify } from 'node:util';
import { afterAll, beforeAll, expect, test } from 'vitest';

const run = promisify(execFile);
const here = fileURLToPath(new URL('..', import.meta.url));
const modules = fileURLToPath(new URL('../../node_modules', import.meta.url));

let project: string;

// Creates a project outside of the checkout that depends on the package as it would be published.
beforeAll(async () => {
  project = await mkdtemp(join(tmpdir(), 'hypermap_package_'));
  const installed = join(project, 'node_modules', '@hypermap', 'client');
  await mkdir(installed, { recursive: true });
  await run('npm', ['pack', '--silent', '--pack-destination', project], { cwd: here });
  const tarball = (await readdir(project)).find((name) => name.endsWith('.tgz')) ?? '';
  await run('tar', ['-xzf', join(project, tarball), '--strip-components=1', '-C', installed]);
  for (const scope of ['@bufbuild', '@connectrpc', '@types']) {
    await symlink(join(modules, scope), join(project, 'node_modules', scope));
  }
  await writeFile(join(project, 'package.json'), '{ "type": "module" }');
  await writeFile(
    join(project, 'main.ts'),
    `import { createHypermapClient, watch, LayerKind, type WatchEvent } from '@hypermap/client';
const client = createHypermapClient('http://127.0.0.1:1', { retries: 0 });
const kinds: LayerKind[] = [LayerKind.SEMANTIC];
const events: AsyncGenerator<WatchEvent> = watch(client, { scope: { map: 'office' } });
const answer: Promise<bigint> = client.catalog.getMap({ map: 'office' }).then(({ map }) => map?.revision ?? 0n);
await answer.catch((error: Error) => console.log(typeof events.next, kinds.length, error.name));
`,
  );
}, 120_000);

afterAll(() => rm(project, { recursive: true, force: true }));

test('a project that installs the package compiles and runs', async () => {
  const tsc = join(modules, '.bin', 'tsc');
  const options = ['--strict', '--target', 'es2022', '--module', 'nodenext', '--types', 'node'];
  await run(tsc, [...options, '--skipLibCheck', 'main.ts'], { cwd: project });
  const { stdout } = await run('node', ['main.js'], { cwd: project });
  expect(stdout).toBe('function 1 ConnectError\n');
}, 120_000);

test('the package holds neither sources nor tests', async () => {
  const all = await readdir(join(project, 'node_modules/@hypermap/client'), { recursive: true });
  const files = all
    .filter((name) => /\.\w+$/.test(name))
    .filter((name) => !name.startsWith('dist/'));
  expect(files.sort()).toEqual(['README.md', 'package.json']);
  expect(all.filter((name) => name.includes('.test.'))).toEqual([]);
});
