import type { FeatureLike } from 'ol/Feature';
import Fill from 'ol/style/Fill';
import Icon from 'ol/style/Icon';
import RegularShape from 'ol/style/RegularShape';
import Stroke from 'ol/style/Stroke';
import Style from 'ol/style/Style';
import Text from 'ol/style/Text';
import type { Look } from './look';

export type ExplorationMark = 'frontier' | 'goal' | 'unreachable' | 'way';

/** The height of a flag's pole and the radius of its foot, pixels before scaling for large screens. */
const POLE = 22;
const FOOT = 3;

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

/** A flag as an icon, whose pole stands on the place. */
function flag(colour: string, ground: string, scale: number): Icon {
  const pole = POLE * scale;
  const foot = FOOT * scale;
  const border = 2 * scale;
  const margin = foot + border;
  const canvas = document.createElement('canvas');
  canvas.width = Math.ceil(0.75 * pole + 2 * margin);
  canvas.height = Math.ceil(pole + 2 * margin);
  const context = canvas.getContext('2d');
  if (context) {
    const shape = new Path2D();
    shape.arc(margin, margin + pole, foot, 0, 2 * Math.PI);
    shape.moveTo(margin, margin + pole);
    shape.lineTo(margin, margin);
    shape.lineTo(margin + 0.75 * pole, margin + 0.27 * pole);
    shape.lineTo(margin, margin + 0.55 * pole);
    context.lineJoin = 'round';
    context.lineWidth = 2 * border;
    context.strokeStyle = ground;
    context.stroke(shape);
    context.lineWidth = border;
    context.strokeStyle = context.fillStyle = colour;
    context.fill(shape);
    context.stroke(shape);
  }
  const units = 'pixels' as const;
  return new Icon({
    img: canvas,
    anchor: [margin, margin + pole],
    anchorXUnits: units,
    anchorYUnits: units,
    declutterMode: 'obstacle',
  });
}

/**
 * Draws frontiers as cells, goals as flags with the robot's name, ways to them as dashed lines,
 * unreachable places as crosses.
 */
export function explorationStyle({ dark, scale }: Look): (feature: FeatureLike) => Style {
  const { accent, ground, frontier, text, bad } = dark ? DARK : LIGHT;
  const goal = flag(accent, ground, scale);
  const cross = new RegularShape({
    points: 4,
    radius: 8 * scale,
    radius2: 0,
    declutterMode: 'obstacle',
    angle: Math.PI / 4,
    stroke: new Stroke({ color: bad, width: 3 * scale }),
  });
  const name = {
    font: `600 ${13 * scale}px system-ui, sans-serif`,
    offsetX: 6 * scale,
    offsetY: -(POLE + 10) * scale,
    fill: new Fill({ color: text }),
    stroke: new Stroke({ color: ground, width: 4 * scale }),
  };
  const plain = {
    frontier: new Style({ fill: new Fill({ color: frontier }) }),
    unreachable: new Style({ image: cross }),
    way: new Style({
      stroke: new Stroke({ color: accent, width: 2 * scale, lineDash: [6 * scale, 5 * scale] }),
    }),
  };
  return (feature) => {
    const mark = feature.get('mark') as ExplorationMark;
    if (mark !== 'goal') return plain[mark];
    const label = new Text({ ...name, text: feature.get('robot') as string });
    return new Style({ image: goal, text: label });
  };
}
