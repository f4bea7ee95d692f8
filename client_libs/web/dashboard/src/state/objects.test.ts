import { expect, it } from 'vitest';
import { ringsOf } from './model';
import { boxOf, drawnObject, polygonOf, squareAround } from './objects';

it('keeps the corners that were drawn, once each', () => {
  const chair = drawnObject('chair', squareAround([10, 5], 2));
  expect(chair.polygon?.outer?.points.map(({ x, y }) => [x, y])).toEqual([
    [9, 4],
    [11, 4],
    [11, 6],
    [9, 6],
  ]);
  expect(chair).toMatchObject({ id: 0n, label: 'chair', existence: 1 });
});

it('converts a polygon with a hole in both directions', () => {
  const rings = [squareAround([0, 0], 4), squareAround([0, 0], 2)];
  expect(ringsOf(polygonOf(rings))).toEqual(rings);
});

it('finds the box around an object, and none around one without a shape', () => {
  const chair = drawnObject('chair', [
    [1, 2],
    [3, -1],
    [2, 7],
    [1, 2],
  ]);
  expect(boxOf(chair)).toEqual([1, -1, 3, 7]);
  expect(boxOf({ ...chair, polygon: undefined })).toBeUndefined();
});
