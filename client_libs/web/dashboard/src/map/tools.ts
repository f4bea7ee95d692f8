// What a pointer does on the map. One tool at a time; without one, clicks ask what is there.
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

/** The map of the page, once it is there. */
export const olMap = signal<OlMap>();

/** What the tool in hand wants to be done, for people. Undefined: no tool. */
export const toolHint = signal<string>();

let dropTool: (() => void) | undefined;
/** When the last tool was put down, by the clock of events. */
let putDownAt = 0;

/** How near a pointer must come to a corner, pixels; more on larger screens. */
const REACH = 10;
/** The same of the corner that ends a drawing. */
const REACH_OF_END = 12;

/** Above content and highlights. */
const ABOVE_ALL = 2000;

function reach(): number {
  return REACH * scale.peek();
}

/** Ends the tool in hand, if any, without a result. */
export function cancelTool(): void {
  dropTool?.();
}

/**
 * Calls for each click that no tool takes. Enter on the map is a click in its middle, for those who
 * use no pointer.
 */
export function onMapClick(handler: (at: Position) => void): () => void {
  const map = olMap.value;
  if (!map) return () => undefined;
  const tell = (at: Coordinate | undefined): void => {
    if (at && toolHint.value === undefined) handler([at[0] ?? 0, at[1] ?? 0]);
  };
  // A single click is told late, when no second one came: the one that ended a tool is the tool's.
  const key = map.on('singleclick', ({ originalEvent, coordinate }) => {
    if (originalEvent.timeStamp > putDownAt) tell(coordinate);
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
  /** After the end, whatever it was. */
  onEnd: () => void;
}

/** Takes a tool in hand; what is returned puts it down. */
function take({ hint, source, interactions, onEnd }: Tool): () => void {
  cancelTool();
  const map = olMap.value;
  if (!map) throw new Error('there is no map yet');
  const layer = new VectorLayer({ source, style: toolStyle(scale.peek()), zIndex: ABOVE_ALL });
  map.addLayer(layer);
  for (const interaction of interactions) map.addInteraction(interaction);
  toolHint.value = hint;
  const putDown = (): void => {
    if (dropTool !== putDown) return;
    dropTool = undefined;
    putDownAt = performance.now();
    for (const interaction of interactions) map.removeInteraction(interaction);
    map.removeLayer(layer);
    toolHint.value = undefined;
    onEnd();
  };
  dropTool = putDown;
  return putDown;
}

/** Lets people draw a polygon. Its outer ring, closed; undefined when they don't. */
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
    const putDown = take({
      hint,
      source,
      interactions: [draw, new Snap({ source, pixelTolerance: reach() })],
      onEnd: () => resolve(drawn),
    });
    draw.on('drawend', ({ feature }) => {
      drawn = (feature.getGeometry() as Polygon).getCoordinates()[0] as Position[];
      // The click that ends the drawing is none of the map.
      setTimeout(putDown);
    });
  });
}

export interface Modification {
  /** The rings as they are now, closed. */
  rings: () => Position[][];
  /** Puts the tool down. */
  end: () => void;
}

/** Lets people move, add and remove the vertices of a polygon. `onEnd` is called when it is over. */
export function modifyPolygon(rings: Position[][], hint: string, onEnd: () => void): Modification {
  const feature = new Feature(new Polygon(rings));
  const source = new VectorSource({ features: [feature] });
  const modify = new Modify({ source, style: toolStyle(scale.peek()), pixelTolerance: reach() });
  const end = take({
    hint,
    source,
    interactions: [modify, new Snap({ source, pixelTolerance: reach() })],
    onEnd,
  });
  return { rings: () => feature.getGeometry()?.getCoordinates() as Position[][], end };
}
