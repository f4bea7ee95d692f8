import type { Position } from '../state/model';
import { shown } from '../state/time';
import { fitContent } from './fit';
import { moveMs, setOut } from './motion';
import { olMap } from './tools';

export function zoomBy(steps: number): void {
  const view = olMap.value?.getView();
  if (view) view.animate({ zoom: (view.getZoom() ?? 0) + steps, duration: moveMs() }, setOut());
}

/** Shows all of the content. */
export function fitAll(): void {
  if (olMap.value) fitContent(olMap.value, shown.value, moveMs());
}

/** The middle of what nothing covers. */
export function middle(): Position | undefined {
  const [x, y] = olMap.value?.getView().getCenter() ?? [];
  return x === undefined || y === undefined ? undefined : [x, y];
}
