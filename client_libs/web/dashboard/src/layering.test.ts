import ts from 'typescript';
import { describe, expect, test } from 'vitest';

/** The folders of the dashboard, highest first. A folder imports only itself and folders below it. */
const FOLDERS = ['.', 'app', 'panels', 'panels/kit', 'map', 'state'];

/** Packages that only one folder imports, and that folder. */
const PACKAGE_OWNERS: Readonly<Record<string, string>> = { ol: 'map', fflate: 'state' };

/** The source text of each module by its path, relative to the folder that is checked. */
type Sources = Readonly<Record<string, string>>;

/** The module specifiers that a source imports or exports from, also by `import()`. */
function specifiersOf(path: string, text: string): string[] {
  const specifiers: string[] = [];
  const visit = (node: ts.Node): void => {
    let specifier: ts.Node | undefined;
    if (ts.isImportDeclaration(node) || ts.isExportDeclaration(node)) {
      specifier = node.moduleSpecifier;
    } else if (ts.isCallExpression(node) && node.expression.kind === ts.SyntaxKind.ImportKeyword) {
      specifier = node.arguments[0];
    } else if (ts.isImportTypeNode(node) && ts.isLiteralTypeNode(node.argument)) {
      specifier = node.argument.literal;
    }
    if (specifier && ts.isStringLiteral(specifier)) specifiers.push(specifier.text);
    ts.forEachChild(node, visit);
  };
  visit(ts.createSourceFile(path, text, ts.ScriptTarget.Latest));
  return specifiers;
}

function folderOf(path: string): string {
  return path.includes('/') ? path.slice(0, path.lastIndexOf('/')) : '.';
}

/** The path of a relative specifier without "." and "..", for example "panels/active". */
function join(folder: string, specifier: string): string {
  const parts: string[] = [];
  for (const part of `${folder}/${specifier}`.split('/')) {
    if (part === '..') parts.pop();
    else if (part !== '.') parts.push(part);
  }
  return parts.join('/');
}

/** The modules that each module imports. Packages and files that are no modules are left out. */
function importGraph(sources: Sources): Map<string, string[]> {
  const resolve = (folder: string, specifier: string): string | undefined => {
    const path = join(folder, specifier).replace(/\.js$/, '');
    return [path, `${path}.ts`, `${path}.tsx`, `${path}/index.ts`].find((file) => file in sources);
  };
  return new Map(
    Object.entries(sources).map(([path, text]) => [
      path,
      specifiersOf(path, text).flatMap((specifier) => {
        const target = specifier.startsWith('.') ? resolve(folderOf(path), specifier) : undefined;
        return target === undefined ? [] : [target];
      }),
    ]),
  );
}

/** One line for each import from a lower folder to a higher one, or from an unlisted folder. */
function upwardImports(sources: Sources): string[] {
  const lines: string[] = [];
  for (const [path, targets] of importGraph(sources)) {
    const level = FOLDERS.indexOf(folderOf(path));
    if (level < 0) lines.push(`${path}: the folder is not listed`);
    for (const target of targets) {
      if (FOLDERS.indexOf(folderOf(target)) < level) lines.push(`${path} imports ${target}`);
    }
  }
  return lines;
}

/** One line for each import of a package by a folder that does not own it. */
function foreignPackages(sources: Sources): string[] {
  return Object.entries(sources).flatMap(([path, text]) =>
    specifiersOf(path, text)
      .filter((specifier) => {
        const owner = PACKAGE_OWNERS[specifier.split('/')[0] ?? ''];
        return owner !== undefined && owner !== folderOf(path);
      })
      .map((specifier) => `${path} imports ${specifier}`),
  );
}

/** An import cycle, with the first module repeated at the end. Undefined when there is none. */
function findCycle(sources: Sources): string[] | undefined {
  const graph = importGraph(sources);
  const finished = new Set<string>();
  const trail: string[] = [];
  const search = (path: string): string[] | undefined => {
    if (trail.includes(path)) return [...trail.slice(trail.indexOf(path)), path];
    if (finished.has(path)) return undefined;
    trail.push(path);
    for (const target of graph.get(path) ?? []) {
      const cycle = search(target);
      if (cycle) return cycle;
    }
    trail.pop();
    finished.add(path);
    return undefined;
  };
  for (const path of graph.keys()) {
    const cycle = search(path);
    if (cycle) return cycle;
  }
  return undefined;
}

function relativeTo(folder: string, modules: Record<string, unknown>): Sources {
  return Object.fromEntries(
    Object.entries(modules).map(([path, text]) => [path.slice(folder.length), String(text)]),
  );
}

// Vite wants the options of each call as a literal.
const dashboard = relativeTo(
  './',
  import.meta.glob('./**/*.{ts,tsx}', { query: '?raw', import: 'default', eager: true }),
);
const client = relativeTo(
  '../../client/src/',
  import.meta.glob('../../client/src/*.ts', { query: '?raw', import: 'default', eager: true }),
);

describe('the dashboard', () => {
  test('is read completely', () => {
    expect(Object.keys(dashboard)).toContain('main.tsx');
    expect(new Set(Object.keys(dashboard).map(folderOf))).toEqual(new Set(FOLDERS));
    expect(importGraph(dashboard).get('main.tsx')).toContain('app/app.tsx');
  });

  test('has no import from a lower folder to a higher one', () => {
    expect(upwardImports(dashboard)).toEqual([]);
  });

  test('has no cycle of imports', () => {
    expect(findCycle(dashboard)).toBeUndefined();
  });

  test('imports a package with an owner only in the folder that owns it', () => {
    expect(foreignPackages(dashboard)).toEqual([]);
  });
});

test('the client has no cycle of imports', () => {
  expect(Object.keys(client)).toContain('index.ts');
  expect(importGraph(client).get('index.ts')).toContain('client.ts');
  expect(findCycle(client)).toBeUndefined();
});

describe('the check finds', () => {
  test.each([
    ['a named import', `import { a } from '../panels/active';`],
    ['an import of types only', `import type { A } from '../panels/active';`],
    ['an import for its side effects', `import '../panels/active';`],
    ['an export', `export { a } from '../panels/active';`],
    ['an import when it is needed', `const a = await import('../panels/active');`],
    ['an imported type', `let a: import('../panels/active').A;`],
  ])('a planted %s of a higher folder', (_, text) => {
    const planted = { 'map/tools.ts': text, 'panels/active.ts': '' };
    expect(upwardImports(planted)).toEqual(['map/tools.ts imports panels/active.ts']);
  });

  test('a planted import from a folder to the entry point above it', () => {
    const planted = { 'app/app.tsx': `import '../main';`, 'main.tsx': `import './app/app';` };
    expect(upwardImports(planted)).toEqual(['app/app.tsx imports main.tsx']);
  });

  test('a planted folder that is not listed', () => {
    expect(upwardImports({ 'extra/thing.ts': '' })).toEqual([
      'extra/thing.ts: the folder is not listed',
    ]);
  });

  test('a planted cycle within a folder, also through an index file', () => {
    const planted = {
      'state/first.ts': `import { second } from './second.js';`,
      'state/second.ts': `export * from '../panels';`,
      'panels/index.ts': `import type { First } from '../state/first';`,
      'panels/free.ts': `import '../state/first';`,
    };
    expect(findCycle(planted)).toEqual([
      'state/first.ts',
      'state/second.ts',
      'panels/index.ts',
      'state/first.ts',
    ]);
  });

  test('a planted package of another folder', () => {
    const planted = {
      'state/view.ts': `import View from 'ol/View';`,
      'map/view.ts': `import 'ol';`,
    };
    expect(foreignPackages(planted)).toEqual(['state/view.ts imports ol/View']);
  });
});
