// Pointer tools for the map. At most one tool is active; without one, clicks go to `onMapClick`.
import { signal } from '@preact/signals';
import type { Coordinate } from 'ol/coordinate';
import type OlMap from 'ol/Map';
import Feature from 'ol/Feature';
import type Polygon from 'ol/geom/Polygon';
import Draw from 'ol/interaction/Draw';
import Modify from 'ol/interaction/Modify';
import Snap from 'ol/interaction/Snap';
import type Interaction from 'ol/interaction/Interaction';
import VectorLayer from 'ol/layer/Vector';
import { unByKey } from 'ol/Observable';
import VectorSource from 'ol/source/Vector';
import type { Position, Shape } from '../state/model';
import type { KindOfShape } from '../state/shapes';
import { geometryOf, shapeOf, type Geometry } from './geometry';
import { clickReach } from './reach';
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
 * Calls `handler` for each click that no tool takes, also with the distance within which lines and
 * points count as clicked, metres. For keyboard users, Enter on the focused map counts as a click
 * at its centre.
 */
export function onMapClick(handler: (at: Position, reachM: number) => void): () => void {
  const map = olMap.value;
  if (!map) return () => undefined;
  const tell = (at: Coordinate | undefined, event: UIEvent): void => {
    if (!at || toolHint.value !== undefined) return;
    handler([at[0] ?? 0, at[1] ?? 0], clickReach(map, event));
  };
  // OpenLayers reports a single click late, when no second one has followed. By then the click may
  // have ended a tool, and it must not also count as a click on the map.
  const key = map.on('singleclick', ({ originalEvent, coordinate }) => {
    if (originalEvent.timeStamp > toolEndedAt) tell(coordinate, originalEvent);
  });
  const target = map.getTargetElement();
  const onKey = (event: KeyboardEvent): void => {
    if (event.key === 'Enter' && event.target === target) tell(map.getView().getCenter(), event);
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

const TYPE_OF = { polygon: 'Polygon', lineString: 'LineString', point: 'Point' } as const;

/** Lets the user draw a shape. Resolves to undefined if they cancel. */
export function drawShape(kind: KindOfShape, hint: string): Promise<Shape | undefined> {
  return new Promise((resolve) => {
    const source = new VectorSource();
    const draw = new Draw({
      source,
      type: TYPE_OF[kind],
      style: toolStyle(scale.peek()),
      snapTolerance: REACH_OF_END * scale.peek(),
    });
    let drawn: Shape | undefined;
    const end = activate({
      hint,
      source,
      interactions: [draw, new Snap({ source, pixelTolerance: reach() })],
      onEnd: () => resolve(drawn),
    });
    draw.on('drawend', ({ feature }) => {
      drawn = shapeOf(feature.getGeometry() as Geometry);
      // The tool is still active while the map handles the click that ends the drawing.
      setTimeout(end);
    });
  });
}

/** Lets the user draw a polygon. Resolves to its closed outer ring; undefined if they cancel. */
export async function drawPolygon(hint: string): Promise<Position[] | undefined> {
  const geometry = geometryOf(await drawShape('polygon', hint));
  return geometry && ((geometry as Polygon).getCoordinates()[0] as Position[]);
}

export interface Modification {
  /** Returns the current shape. */
  shape: () => Shape;
  /** Ends the tool. */
  end: () => void;
}

/**
 * Lets the user move, add and remove vertices of a polygon or a line, or move a point. `onEnd` is
 * called when the tool ends.
 */
export function modifyShape(geometry: Geometry, hint: string, onEnd: () => void): Modification {
  const source = new VectorSource({ features: [new Feature(geometry)] });
  const modify = new Modify({ source, style: toolStyle(scale.peek()), pixelTolerance: reach() });
  const end = activate({
    hint,
    source,
    interactions: [modify, new Snap({ source, pixelTolerance: reach() })],
    onEnd,
  });
  return { shape: () => shapeOf(geometry), end };
}
