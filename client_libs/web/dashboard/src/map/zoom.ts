import type View from 'ol/View';
import { beginMove, moveMs } from './motion';

/** The zoom level that the unfinished step of each view ends at. */
const targets = new WeakMap<View, { zoom: number }>();

/**
 * Zooms in by a number of levels, or out by a negative number. A step during an unfinished step
 * starts from the level where that one would end, not from the level that is painted at the moment.
 * Therefore a step in and a step out always cancel out, however quickly they follow each other.
 */
export function zoomBy(view: View, steps: number): void {
  const zoom = view.getConstrainedZoom((targets.get(view)?.zoom ?? view.getZoom() ?? 0) + steps);
  if (zoom === undefined) return;
  // OpenLayers would run both animations at once, and whichever it updates last would win.
  view.cancelAnimations();
  const target = { zoom };
  targets.set(view, target);
  const endMove = beginMove();
  view.animate({ zoom, duration: moveMs() }, () => {
    endMove();
    // The callback of a cancelled step comes late, when the next step has set its own target.
    if (targets.get(view) === target) targets.delete(view);
  });
}
