import type { FeatureLike } from 'ol/Feature';
import CircleStyle from 'ol/style/Circle';
import Fill from 'ol/style/Fill';
import RegularShape from 'ol/style/RegularShape';
import Stroke from 'ol/style/Stroke';
import Style from 'ol/style/Style';
import Text from 'ol/style/Text';
import type { Look } from './look';

export type ExplorationMark = 'frontier' | 'goal' | 'unreachable';

const LIGHT = {
  accent: '#2560c9',
  ground: '#ffffff',
  frontier: 'rgba(217,119,6,.9)',
  text: '#1b2430',
  bad: '#c0302b',
};
const DARK = {
  accent: '#7fb0ff',
  ground: '#0f1318',
  frontier: 'rgba(240,182,90,.9)',
  text: '#e7ecf2',
  bad: '#ff8a84',
};

/**
 * Draws frontiers as cells, goals as discs with the robot's name, unreachable places as crosses.
 */
export function explorationStyle({ dark, scale }: Look): (feature: FeatureLike) => Style {
  const { accent, ground, frontier, text, bad } = dark ? DARK : LIGHT;
  const disc = new CircleStyle({
    radius: 8 * scale,
    fill: new Fill({ color: accent }),
    stroke: new Stroke({ color: ground, width: 3 * scale }),
  });
  const cross = new RegularShape({
    points: 4,
    radius: 8 * scale,
    radius2: 0,
    angle: Math.PI / 4,
    stroke: new Stroke({ color: bad, width: 3 * scale }),
  });
  const name = {
    font: `600 ${13 * scale}px system-ui, sans-serif`,
    offsetY: -20 * scale,
    fill: new Fill({ color: text }),
    stroke: new Stroke({ color: ground, width: 4 * scale }),
  };
  const plain = {
    frontier: new Style({ fill: new Fill({ color: frontier }) }),
    unreachable: new Style({ image: cross }),
  };
  return (feature) => {
    const mark = feature.get('mark') as ExplorationMark;
    if (mark !== 'goal') return plain[mark];
    const label = new Text({ ...name, text: feature.get('robot') as string });
    return new Style({ image: disc, text: label });
  };
}
