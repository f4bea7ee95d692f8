import type { Frontier, Goal, UnreachablePlace } from '@hypermap/client';
import { effect } from '@preact/signals';
import Feature from 'ol/Feature';
import type Geometry from 'ol/geom/Geometry';
import LineString from 'ol/geom/LineString';
import MultiPolygon from 'ol/geom/MultiPolygon';
import Point from 'ol/geom/Point';
import VectorLayer from 'ol/layer/Vector';
import type OlMap from 'ol/Map';
import VectorSource from 'ol/source/Vector';
import { explorationReport, type ExplorationReport } from '../state/exploration';
import { squareAround } from '../state/objects';
import { robots } from '../state/robots';
import { dark } from '../state/theme';
import { asOf } from '../state/time';
import { explorationStyle, type ExplorationMark } from './exploration_style';
import { scale } from './scale';

/** The z-index above content and below highlights. */
const ABOVE_CONTENT = 900;

function feature(mark: ExplorationMark, geometry: Geometry, robot = ''): Feature {
  return new Feature({ geometry, mark, robot });
}

function frontierFeature(frontiers: readonly Frontier[], sideM: number): Feature {
  const squares = frontiers.flatMap(({ cells }) =>
    cells.map(({ x, y }) => [squareAround([x, y], sideM)]),
  );
  return feature('frontier', new MultiPolygon(squares));
}

function placeFeature(mark: ExplorationMark, place: Goal | UnreachablePlace): Feature[] {
  const { position, robot } = place;
  return position ? [feature(mark, new Point([position.x, position.y]), robot)] : [];
}

/** The line from a robot to its goal, if it is known where the robot is. */
function wayFeature({ position, robot }: Goal): Feature[] {
  const start = robots.value.get(robot)?.position;
  return start && position
    ? [feature('way', new LineString([start, [position.x, position.y]]))]
    : [];
}

function featuresOf({ exploration, progress, frontiers }: ExplorationReport): Feature[] {
  return [
    frontierFeature(frontiers, Math.sqrt(progress.cellAreaM2)),
    ...exploration.unreachablePlaces.flatMap((place) => placeFeature('unreachable', place)),
    ...exploration.goals.flatMap(wayFeature),
    ...exploration.goals.flatMap((goal) => placeFeature('goal', goal)),
  ];
}

/**
 * Shows the frontiers, goals and unreachable places of the exploration in the open panel, and the
 * ways of robots to their goals.
 */
export function showExploration(map: OlMap): () => void {
  const source = new VectorSource();
  const layer = new VectorLayer({ source, zIndex: ABOVE_CONTENT, declutter: true });
  map.addLayer(layer);
  const stops = [
    effect(() => layer.setStyle(explorationStyle({ dark: dark.value, scale: scale.value }))),
    effect(() => {
      const report = asOf.value === undefined ? explorationReport.value : undefined;
      source.clear(true);
      if (report) source.addFeatures(featuresOf(report));
    }),
  ];
  return () => {
    for (const stop of stops) stop();
    map.removeLayer(layer);
  };
}
