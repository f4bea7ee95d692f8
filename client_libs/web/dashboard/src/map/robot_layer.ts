import { effect } from '@preact/signals';
import Feature from 'ol/Feature';
import Point from 'ol/geom/Point';
import VectorLayer from 'ol/layer/Vector';
import type OlMap from 'ol/Map';
import VectorSource from 'ol/source/Vector';
import { clock, robots, seenWords } from '../state/robots';
import { dark } from '../state/theme';
import { asOf } from '../state/time';
import { robotStyle } from './robot_style';
import { scale } from './scale';

/** The z-index above the marks of explorations and below highlights. */
const ABOVE_EXPLORATION = 920;

/** Shows the robots where they are, and how long ago they were there, while the map is live. */
export function showRobots(map: OlMap): () => void {
  const source = new VectorSource();
  const layer = new VectorLayer({ source, zIndex: ABOVE_EXPLORATION, declutter: true });
  map.addLayer(layer);
  const stop = effect(() => {
    const style = robotStyle({ dark: dark.value, scale: scale.value });
    const drawn = asOf.value === undefined ? [...robots.value.values()] : [];
    source.clear(true);
    for (const robot of drawn) {
      const feature = new Feature(new Point(robot.position));
      feature.setStyle(style(robot, seenWords(robot, clock.value)));
      source.addFeature(feature);
    }
  });
  return () => {
    stop();
    map.removeLayer(layer);
  };
}
