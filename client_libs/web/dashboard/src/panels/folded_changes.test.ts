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

it('joins changes of the same object within seconds to one line', () => {
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

it('keeps changes of different kinds, objects and times apart', () => {
  const entries = [
    entry(60, {}),
    entry(59, { kind: ChangeKind.REMOVE }),
    entry(58, { objectId: 2n }),
    entry(57, { layer: 'dock' }),
    entry(40, {}),
  ];
  expect(foldChanges(entries)).toHaveLength(entries.length);
});

it('keeps the creation of an object apart from its later changes', () => {
  const folded = foldChanges([entry(3, {}), entry(2, {}), entry(1, { isNew: true })]);
  expect(folded.map(({ newest, times }) => [newest.isNew, times])).toEqual([
    [false, 2],
    [true, 1],
  ]);
});
