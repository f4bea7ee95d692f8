// Pointer tools for the map. At most one tool is active; without one, clicks go to `onMapClick`.
import { signal } from '@preact/signals';
import type { Coordinate } from 'ol/coordinate';
import type OlMap from 'ol/Map';
import Feature from 'ol/Feature';
import Polygon from 'ol/geom/Polygon';
import Draw from 'ol/interaction/Draw';
import Modify from 'ol/interaction/Modify';
import Snap from 'ol/interaction/Snap';
import type Interaction from 'ol/interaction/Interaction';
import VectorLayer from 'ol/layer/Vector';
import { unByKey } from 'ol/Observable';
import VectorSource from 'ol/source/Vector';
import type { Position } from '../state/model';
import { scale } from './scale';
import { toolStyle } from './tool_style';

/** The map of the page. Undefined until it is mounted. */
export const olMap = signal<OlMap>();

/** The instructions of the active tool for the user. Undefined if no tool is active. */
export const toolHint = signal<string>();

let endTool: (() => void) | undefined;
/** The time at which the last tool ended, on the clock of Event.timeStamp. */
let toolEndedAt = 0;

/** The distance within which a pointer grabs a corner, pixels before scaling for large screens. */
const REACH = 10;
/** The same for the corner that ends a drawing. */
const REACH_OF_END = 12;

/** The z-index above content and highlights. */
const ABOVE_ALL = 2000;

function reach(): number {
  return REACH * scale.peek();
}

/** Ends the active tool, if any, without a result. */
export function cancelTool(): void {
  endTool?.();
}

/**
 * Calls `handler` for each click that no tool takes. For keyboard users, Enter on the focused map
 * counts as a click at its centre.
 */
export function onMapClick(handler: (at: Position) => void): () => void {
  const map = olMap.value;
  if (!map) return () => undefined;
  const tell = (at: Coordinate | undefined): void => {
    if (at && toolHint.value === undefined) handler([at[0] ?? 0, at[1] ?? 0]);
  };
  // OpenLayers reports a single click late, when no second one has followed. By then the click may
  // have ended a tool, and it must not also count as a click on the map.
  const key = map.on('singleclick', ({ originalEvent, coordinate }) => {
    if (originalEvent.timeStamp > toolEndedAt) tell(coordinate);
  });
  const target = map.getTargetElement();
  const onKey = (event: KeyboardEvent): void => {
    if (event.key === 'Enter' && event.target === target) tell(map.getView().getCenter());
  };
  target?.addEventListener('keydown', onKey);
  return () => {
    unByKey(key);
    target?.removeEventListener('keydown', onKey);
  };
}

interface Tool {
  hint: string;
  source: VectorSource;
  interactions: Interaction[];
  /** Called when the tool has ended for any reason. */
  onEnd: () => void;
}

/** Activates a tool. The returned function ends it. */
function activate({ hint, source, interactions, onEnd }: Tool): () => void {
  cancelTool();
  const map = olMap.value;
  if (!map) throw new Error('there is no map yet');
  const layer = new VectorLayer({ source, style: toolStyle(scale.peek()), zIndex: ABOVE_ALL });
  map.addLayer(layer);
  for (const interaction of interactions) map.addInteraction(interaction);
  toolHint.value = hint;
  const end = (): void => {
    if (endTool !== end) return;
    endTool = undefined;
    toolEndedAt = performance.now();
    for (const interaction of interactions) map.removeInteraction(interaction);
    map.removeLayer(layer);
    toolHint.value = undefined;
    onEnd();
  };
  endTool = end;
  return end;
}

/** Lets the user draw a polygon. Resolves to its closed outer ring; undefined if they cancel. */
export function drawPolygon(hint: string): Promise<Position[] | undefined> {
  return new Promise((resolve) => {
    const source = new VectorSource();
    const draw = new Draw({
      source,
      type: 'Polygon',
      style: toolStyle(scale.peek()),
      snapTolerance: REACH_OF_END * scale.peek(),
    });
    let drawn: Position[] | undefined;
    const end = activate({
      hint,
      source,
      interactions: [draw, new Snap({ source, pixelTolerance: reach() })],
      onEnd: () => resolve(drawn),
    });
    draw.on('drawend', ({ feature }) => {
      drawn = (feature.getGeometry() as Polygon).getCoordinates()[0] as Position[];
      // The tool is still active while the map handles the click that ends the drawing.
      setTimeout(end);
    });
  });
}

export interface Modification {
  /** Returns the current rings, closed. */
  rings: () => Position[][];
  /** Ends the tool. */
  end: () => void;
}

/**
 * Lets the user move, add and remove vertices of a polygon. `onEnd` is called when the tool ends.
 */
export function modifyPolygon(rings: Position[][], hint: string, onEnd: () => void): Modification {
  const feature = new Feature(new Polygon(rings));
  const source = new VectorSource({ features: [feature] });
  const modify = new Modify({ source, style: toolStyle(scale.peek()), pixelTolerance: reach() });
  const end = activate({
    hint,
    source,
    interactions: [modify, new Snap({ source, pixelTolerance: reach() })],
    onEnd,
  });
  return { rings: () => feature.getGeometry()?.getCoordinates() as Position[][], end };
}
