import { effect, untracked } from '@preact/signals';
import { boundingExtent, containsExtent, containsXY, getCenter, type Extent } from 'ol/extent';
import type OlMap from 'ol/Map';
import { ringsOf, type Position } from '../state/model';
import { highlight, selected, selectedId } from '../state/selection';
import { fitTo, fitted } from './fit';
import { beginMove, isPageMoving, moveMs } from './motion';
import { mapPadding, pad, type Sides } from './padding';
import { scale } from './scale';
import { fitsInto, hiddenShare, shiftToSee } from './sight';

/** Between what people look at and what covers the map, pixels. */
const MARGIN = 40;
/** When so much of what the map was fitted to is covered, it is fitted again. */
const TOO_MUCH = 0.4;

/** The box of the selected object, if it lies at a point. */
function objectAt([x, y]: Position): Extent | undefined {
  const polygon = selected.peek()?.object.polygon;
  const box = polygon && boundingExtent(ringsOf(polygon)[0] ?? []);
  return box && containsXY(box, x, y) ? box : undefined;
}

/** Moves the map so that a box is in sight. One that is larger than the sight is left as it is. */
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
 * Keeps what people look at where panels leave it in sight: what they clicked, else what the map was
 * fitted to. Who moves the map away from it is not called back.
 */
export function keepInSight(map: OlMap): () => void {
  const view = map.getView();
  let clicked: Extent | undefined;
  /** The object there. */
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

  // The object is told after the point.
  const stopObject = effect(() => {
    if (selectedId.value === undefined) return;
    const { point } = highlight.peek();
    object = point && untracked(() => objectAt(point));
    if (object) reveal(map, object);
  });

  let last: Sides = [0, 0, 0, 0];
  const stopPadding = effect(() => {
    const sides = mapPadding.value;
    // What glides on after people let go of it stops here.
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

/** Fits the map again if much of what it was fitted to is covered now. */
function refit(map: OlMap): void {
  const fit = fitted.peek();
  if (!fit || hiddenShare(fit.box, map.getView().calculateExtent()) <= TOO_MUCH) return;
  fitTo(map, { ...fit, durationMs: moveMs() });
}
