import { effect, untracked } from '@preact/signals';
import { buffer, containsExtent, containsXY, getCenter, type Extent } from 'ol/extent';
import type OlMap from 'ol/Map';
import type { Position } from '../state/model';
import { highlight, selected, selectedId } from '../state/selection';
import { boxOf } from '../state/shapes';
import { fitTo, fitted } from './fit';
import { beginMove, isPageMoving, moveMs } from './motion';
import { mapPadding, pad, type Sides } from './padding';
import { clickReach } from './reach';
import { scale } from './scale';
import { fitsInto, hiddenShare, shiftToSee } from './sight';

/** The margin between a revealed box and the panels, pixels before scaling for large screens. */
const MARGIN = 40;
/** If more than this share of the fitted box is hidden, the map is fitted again. */
const TOO_MUCH = 0.4;

/** The bounding box of the selected object, if a click at a point may have meant it. */
function objectAt([x, y]: Position, reachM: number): Extent | undefined {
  const object = selected.peek()?.object;
  const box = object && boxOf(object);
  return box && containsXY(buffer(box, reachM), x, y) ? box : undefined;
}

/** Moves the map so that a box becomes visible. Does nothing if the box is larger than the view. */
function reveal(map: OlMap, box: Extent): void {
  const view = map.getView();
  const resolution = view.getResolution() ?? 0;
  const sight = view.calculateExtent();
  if (!fitsInto(box, sight)) return;
  const [dx, dy] = shiftToSee(box, sight, MARGIN * scale.peek() * resolution);
  if (dx === 0 && dy === 0) return;
  const [x = 0, y = 0] = getCenter(sight);
  view.cancelAnimations();
  view.animate({ center: [x + dx, y + dy], duration: moveMs() }, beginMove());
}

/**
 * Keeps the focus of the user visible beside the panels: the clicked point or object, otherwise the
 * box that the map was last fitted to. A focus that the user has moved out of the view is not
 * brought back.
 */
export function keepInSight(map: OlMap): () => void {
  const view = map.getView();
  let clicked: Extent | undefined;
  /** The bounding box of the selected object at the clicked point. */
  let object: Extent | undefined;

  const stopPoint = effect(() => {
    const { point } = highlight.value;
    object = undefined;
    clicked = point && [...point, ...point];
    if (clicked) reveal(map, clicked);
  });

  const stopFitted = effect(() => {
    if (fitted.value) clicked = object = undefined;
  });

  // The answer with the object arrives after the point was set.
  const stopObject = effect(() => {
    if (selectedId.value === undefined) return;
    const { point } = highlight.peek();
    object = point && untracked(() => objectAt(point, clickReach(map)));
    if (object) reveal(map, object);
  });

  let last: Sides = [0, 0, 0, 0];
  const stopPadding = effect(() => {
    const sides = mapPadding.value;
    // Ends the kinetic panning after a drag: the animation has a target for the previous padding.
    if (view.getAnimating() && !isPageMoving()) view.cancelAnimations();
    const sight = view.calculateExtent();
    pad(view, sides, map.getSize() ?? [innerWidth, innerHeight]);
    const isMoreCovered = sides.some((size, i) => size > (last[i] ?? 0));
    last = sides;
    if (!isMoreCovered) return;
    const isSeen = (box: Extent | undefined): box is Extent =>
      box !== undefined && (isPageMoving() || containsExtent(sight, box));
    const left = view.calculateExtent();
    const seen = [object, clicked, fitted.peek()?.box].filter(isSeen);
    const fitting = seen.find((box) => fitsInto(box, left));
    if (fitting) reveal(map, fitting);
    else if (seen.length > 0 && !clicked) untracked(() => refit(map));
  });

  return () => {
    stopPoint();
    stopFitted();
    stopObject();
    stopPadding();
  };
}

/** Fits the map again if panels now hide much of the fitted box. */
function refit(map: OlMap): void {
  const fit = fitted.peek();
  if (!fit || hiddenShare(fit.box, map.getView().calculateExtent()) <= TOO_MUCH) return;
  fitTo(map, { ...fit, durationMs: moveMs() });
}
