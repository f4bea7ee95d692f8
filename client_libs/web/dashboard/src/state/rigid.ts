// Rigid transforms of the plane, which lay one map over another.
import { create, PoseSchema } from '@hypermap/client';
import type { GridGeometry, Position } from './model';

/** The pose of a frame in another one: metres, and radians counter-clockwise. */
export interface Pose2 {
  readonly x: number;
  readonly y: number;
  readonly yaw: number;
}

export const IDENTITY: Pose2 = { x: 0, y: 0, yaw: 0 };

/** Converts a position in the frame that has the pose to the frame that the pose is in. */
export function transform({ x, y, yaw }: Pose2, [px, py]: Position): Position {
  const [cos, sin] = [Math.cos(yaw), Math.sin(yaw)];
  return [x + cos * px - sin * py, y + sin * px + cos * py];
}

/** The inverse of `transform`. */
export function transformBack({ x, y, yaw }: Pose2, [px, py]: Position): Position {
  return transform({ x: 0, y: 0, yaw: -yaw }, [px - x, py - y]);
}

/** The grid of a frame as it lies in the frame that the pose is in. */
export function transformGrid(pose: Pose2, grid: GridGeometry): GridGeometry {
  const { x: gridX = 0, y: gridY = 0, yaw: gridYaw = 0 } = grid.origin ?? {};
  const [x, y] = transform(pose, [gridX, gridY]);
  return { ...grid, origin: create(PoseSchema, { x, y, yaw: pose.yaw + gridYaw }) };
}
