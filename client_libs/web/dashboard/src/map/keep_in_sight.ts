import { effect } from '@preact/signals';
import type OlMap from 'ol/Map';
import { point } from '../state/point';
import { mapPadding } from './padding';

const MOVE_MS = 200;
/** From what covers the map, pixels. */
const MARGIN = 40;

/** By how much a place must move to lie between two bounds. */
function shiftInto(place: number, low: number, high: number): number {
  if (place < low) return low - place;
  return place > high ? high - place : 0;
}

/** Moves the map when what was asked about would lie below a panel that opens. */
export function keepInSight(map: OlMap): () => void {
  return effect(() => {
    const [top, right, bottom, left] = mapPadding.value;
    const at = point.answer.value?.at;
    const pixel = at && map.getPixelFromCoordinate([...at]);
    const [width = 0, height = 0] = map.getSize() ?? [];
    if (!pixel) return;
    const dx = shiftInto(pixel[0] ?? 0, left + MARGIN, width - right - MARGIN);
    const dy = shiftInto(pixel[1] ?? 0, top + MARGIN, height - bottom - MARGIN);
    const view = map.getView();
    const [x = 0, y = 0] = view.getCenter() ?? [];
    const resolution = view.getResolution() ?? 0;
    if (dx === 0 && dy === 0) return;
    view.animate({ center: [x - dx * resolution, y + dy * resolution], duration: MOVE_MS });
  });
}
