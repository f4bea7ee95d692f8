import { effect } from '@preact/signals';
import { useEffect, useRef } from 'preact/hooks';
import { defaults as defaultInteractions } from 'ol/interaction/defaults';
import KeyboardPan from 'ol/interaction/KeyboardPan';
import OlMap from 'ol/Map';
import View from 'ol/View';
import 'ol/ol.css';
import { wantedView } from '../state/selection';
import { view as shownView } from '../state/url';
import { showAlignment } from './align_layer';
import { showContent } from './content_layers';
import { showExploration } from './exploration_layer';
import { fitTo, fitWhenThere, noteView } from './fit';
import { showHighlight } from './highlight_layer';
import { showHover } from './hover';
import { keepInSight } from './keep_in_sight';
import './map.css';
import { moveMs } from './motion';
import { planar } from './projection';
import { resolution } from './resolution';
import { showRobots } from './robot_layer';
import { olMap } from './tools';
import { zoomKeys } from './zoom_keys';

/**
 * The range of resolutions, metres per pixel: a coin fills the screen, or a whole district fits.
 */
const FINEST = 0.0005;
const COARSEST = 10;
/** The margin around a box that the map moves to, pixels. */
const MARGIN = 60;

function makeMap(target: HTMLElement): OlMap {
  const start = shownView.value;
  return new OlMap({
    target,
    controls: [],
    interactions: defaultInteractions({
      altShiftDragRotate: false,
      pinchRotate: false,
      keyboard: false,
    }).extend([new KeyboardPan(), zoomKeys()]),
    view: new View({
      projection: planar,
      center: start?.center ?? [0, 0],
      resolution: start?.resolution ?? 0.05,
      minResolution: FINEST,
      maxResolution: COARSEST,
      enableRotation: false,
      showFullExtent: true,
    }),
  });
}

function keepView(map: OlMap): () => void {
  const note = (): void => {
    // Until the first content is fitted, the view is meaningless.
    if (shownView.value) noteView(map);
  };
  map.on('moveend', note);
  return () => map.un('moveend', note);
}

function tellResolution(map: OlMap): () => void {
  const view = map.getView();
  const tell = (): void => {
    resolution.value = view.getResolution() ?? resolution.value;
  };
  tell();
  view.on('change:resolution', tell);
  return () => view.un('change:resolution', tell);
}

function followWantedView(map: OlMap): () => void {
  return effect(() => {
    const wanted = wantedView.value;
    if (!wanted) return;
    fitTo(map, { box: wanted.box, margin: MARGIN, durationMs: moveMs() });
  });
}

/** The map, which fills its parent element. */
export function MapView() {
  const target = useRef<HTMLDivElement>(null);
  useEffect(() => {
    if (!target.current) return undefined;
    const map = makeMap(target.current);
    olMap.value = map;
    const stops = [
      keepInSight(map),
      showContent(map),
      showExploration(map),
      showAlignment(map),
      showRobots(map),
      showHighlight(map),
      showHover(map),
      fitWhenThere(map),
      keepView(map),
      tellResolution(map),
      followWantedView(map),
    ];
    return () => {
      for (const stop of stops) stop();
      olMap.value = undefined;
      map.setTarget(undefined);
      map.dispose();
    };
  }, []);
  return <div ref={target} class="map" role="application" aria-label="Map" tabIndex={0} />;
}
