import { expect, it } from 'vitest';
import type { ChangeEntry } from '../state/changes';
import { ChangeKind } from '../state/model';
import { foldChanges } from './folded_changes';

let key = 0;

function entry(seconds: number, of: Partial<ChangeEntry>): ChangeEntry {
  const revision = BigInt(key++);
  const time = new Date(seconds * 1000);
  const thing = { layer: 'objects', kind: ChangeKind.PUT, objectId: 1n, label: 'chair' };
  return { key, revision, time, author: '', isNew: false, cells: 0, ...thing, ...of };
}

it('makes one line of what is done to a thing within seconds', () => {
  const cells = { layer: 'explored', kind: ChangeKind.CELLS, objectId: undefined };
  const folded = foldChanges([
    entry(9, { ...cells, cells: 5 }),
    entry(8, { objectId: 2n }),
    entry(7, { ...cells, cells: 3 }),
    entry(6, { objectId: 2n }),
  ]);
  expect(folded.map(({ newest, times, cells }) => [newest.layer, times, cells])).toEqual([
    ['explored', 2, 8],
    ['objects', 2, 0],
  ]);
});

it('tells apart what was done, to what, and when', () => {
  const entries = [
    entry(60, {}),
    entry(59, { kind: ChangeKind.REMOVE }),
    entry(58, { objectId: 2n }),
    entry(57, { layer: 'dock' }),
    entry(40, {}),
  ];
  expect(foldChanges(entries)).toHaveLength(entries.length);
});

it('tells that a thing was added, then changed', () => {
  const folded = foldChanges([entry(3, {}), entry(2, {}), entry(1, { isNew: true })]);
  expect(folded.map(({ newest, times }) => [newest.isNew, times])).toEqual([
    [false, 2],
    [true, 1],
  ]);
});
