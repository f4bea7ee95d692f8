import { signal } from '@preact/signals';
import type View from 'ol/View';

export type Sides = readonly [top: number, right: number, bottom: number, left: number];

/** The widths of the strips that panels cover at each side of the map, pixels. */
export const mapPadding = signal<Sides>([0, 0, 0, 0]);

/** The share of the map that always counts as uncovered, even if panels cover more. */
const LEAST_SHARE = 0.2;

/** Shrinks the paddings of two opposite sides so that they leave LEAST_SHARE of the size. */
function limit(low: number, high: number, size: number): [number, number] {
  const part = Math.min(1, ((1 - LEAST_SHARE) * size) / Math.max(1, low + high));
  return [low * part, high * part];
}

/** Makes the centre of the uncovered part the centre of the view. Nothing moves on the screen. */
export function pad(view: View, [top, right, bottom, left]: Sides, size: readonly number[]): void {
  const [width = 0, height = 0] = size;
  const [up, down] = limit(top, bottom, height);
  const [west, east] = limit(left, right, width);
  view.padding = [up, east, down, west];
}
