import type { Position } from '../state/model';
import { shown } from '../state/time';
import { fitContent } from './fit';
import { moveMs } from './motion';
import { olMap } from './tools';
import { zoomBy as zoomView } from './zoom';

/** Zooms in by a number of levels, or out by a negative number. */
export function zoomBy(steps: number): void {
  if (olMap.value) zoomView(olMap.value.getView(), steps);
}

/** Fits all of the content into the view. */
export function fitAll(): void {
  if (olMap.value) fitContent(olMap.value, shown.value, moveMs());
}

/** The centre of the part of the map that no panel covers. */
export function middle(): Position | undefined {
  const [x, y] = olMap.value?.getView().getCenter() ?? [];
  return x === undefined || y === undefined ? undefined : [x, y];
}
