import { expect, test } from 'vitest';
import { fitsInto, hiddenShare, shiftToSee } from './sight';

const sight = [0, 0, 10, 6];

test.each([
  ['a box well inside the view needs no move', [4, 2, 6, 4], [0, 0]],
  ['a box beyond the right edge', [9, 2, 12, 4], [3, 0]],
  ['a box beyond the left and lower edges', [-2, -3, 0, -1], [-3, -4]],
  ['a point above the view', [5, 8, 5, 8], [0, 3]],
  ['a box as wide as the view, which leaves no room for a margin', [1, 2, 11, 4], [1, 0]],
  ['a box that leaves room for a part of the margin', [1, 2, 10, 4], [0.5, 0]],
])('%s', (_, box, moved) => {
  expect(shiftToSee(box, sight, 1)).toEqual(moved);
});

test('a box fits or does not', () => {
  expect(fitsInto([20, 20, 30, 26], sight)).toBe(true);
  expect(fitsInto([0, 0, 10.1, 1], sight)).toBe(false);
});

test.each([
  [[1, 1, 2, 2], 0],
  [[0, 0, 10, 12], 0.5],
  [[5, 0, 15, 12], 0.75],
  [[20, 20, 21, 21], 1],
])('of %j a share of %d is hidden', (box, share) => {
  expect(hiddenShare(box, sight)).toBeCloseTo(share);
});
