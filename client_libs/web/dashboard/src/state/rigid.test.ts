import { create, GridGeometrySchema } from '@hypermap/client';
import { expect, test } from 'vitest';
import type { Position } from './model';
import { IDENTITY, transform, transformBack, transformGrid } from './rigid';

const pose = { x: 4, y: 2, yaw: Math.PI / 2 };

function expectNear(got: Position, wanted: Position): void {
  expect(got[0]).toBeCloseTo(wanted[0], 9);
  expect(got[1]).toBeCloseTo(wanted[1], 9);
}

test('a position is turned counter-clockwise, then moved', () => {
  expectNear(transform(pose, [1, 0]), [4, 3]);
  expectNear(transform(pose, [0, 1]), [3, 2]);
  expectNear(transform(IDENTITY, [5, -6]), [5, -6]);
});

test('the inverse leads back', () => {
  expectNear(transformBack(pose, [4, 3]), [1, 0]);
  for (const at of [
    [0, 0],
    [7.5, -3],
    [-2, 11],
  ] as Position[]) {
    expectNear(
      transformBack({ x: -1, y: 3, yaw: 2.5 }, transform({ x: -1, y: 3, yaw: 2.5 }, at)),
      at,
    );
  }
});

test('a grid keeps its cells and its resolution', () => {
  const grid = create(GridGeometrySchema, {
    origin: { x: 1, y: 0, yaw: 0.25 },
    resolutionM: 0.05,
  });
  const laid = transformGrid(pose, grid);
  expect(laid.resolutionM).toBe(0.05);
  expect(laid.origin?.yaw).toBeCloseTo(Math.PI / 2 + 0.25, 9);
  expectNear([laid.origin?.x ?? NaN, laid.origin?.y ?? NaN], [4, 3]);
  expect(grid.origin?.x).toBe(1);
});
