import { mapPadding } from './padding';
import { contentBox } from './fit';
import { olMap } from './tools';
import { shown } from '../state/time';

const MOVE_MS = 200;

export function zoomBy(steps: number): void {
  const view = olMap.value?.getView();
  if (view) view.animate({ zoom: (view.getZoom() ?? 0) + steps, duration: MOVE_MS });
}

/** Shows all of the content. */
export function fitAll(): void {
  const box = contentBox(shown.value);
  if (box) olMap.value?.getView().fit(box, { padding: [...mapPadding.value], duration: MOVE_MS });
}
