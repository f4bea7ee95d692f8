import type OlMap from 'ol/Map';
import { scale } from './scale';

// Distance from a line or a point up to which a click counts as a click on it, in pixels before
// scaling for large screens.
const REACH_OF_POINTER = 8;
const REACH_OF_FINGER = 16;

/** The maximum distance of a click on a line or a point from it, metres. */
export function clickReach(map: OlMap, event?: UIEvent): number {
  const isFinger = event instanceof PointerEvent && event.pointerType === 'touch';
  const pixels = (isFinger ? REACH_OF_FINGER : REACH_OF_POINTER) * scale.peek();
  return pixels * (map.getView().getResolution() ?? 0);
}
