import type { FeatureLike } from 'ol/Feature';
import CircleStyle from 'ol/style/Circle';
import Fill from 'ol/style/Fill';
import RegularShape from 'ol/style/RegularShape';
import Stroke from 'ol/style/Stroke';
import Style from 'ol/style/Style';
import Text from 'ol/style/Text';
import { css } from './colours';
import type { MarkColour } from './highlight_cells';
import type { Look } from './look';
import { POINT_RADIUS } from './shape_paint';

/** The colour of the map that lies over the shown one, which no class and no mark has. */
export const OVERLAY_COLOUR: MarkColour = {
  light: [190, 24, 147],
  dark: [255, 122, 217],
  alpha: { light: 0.75, dark: 0.75 },
};

/**
 * An object of the overlay; the places of a pair in the source and in the target, and the line
 * between them if the pair agrees or may do so, or if it does not.
 */
export type AlignMark = 'object' | 'source' | 'target' | 'way' | 'disagreement';

/**
 * Draws the objects of the overlay as outlines, places of the source as crosses, and those of the
 * target as discs with their names. A broken line joins a pair that does not agree.
 */
export function alignStyle({ dark, scale }: Look): (feature: FeatureLike) => Style {
  const overlay = css(dark ? OVERLAY_COLOUR.dark : OVERLAY_COLOUR.light);
  const text = dark ? '#e7ecf2' : '#1b2430';
  const ground = dark ? '#0f1318' : '#ffffff';
  const line = (color: string, width: number, lineDash: number[] = []) =>
    new Stroke({ color, width: width * scale, lineDash: lineDash.map((part) => part * scale) });
  const disc = new CircleStyle({
    radius: 5 * scale,
    fill: new Fill({ color: text }),
    stroke: line(ground, 2),
  });
  const cross = new RegularShape({
    points: 4,
    radius: 9 * scale,
    radius2: 0,
    angle: Math.PI / 4,
    stroke: line(overlay, 3),
  });
  const name = {
    font: `600 ${13 * scale}px system-ui, sans-serif`,
    offsetX: 12 * scale,
    offsetY: -12 * scale,
    fill: new Fill({ color: text }),
    stroke: line(ground, 4),
  };
  const plain: Record<Exclude<AlignMark, 'target'>, Style> = {
    object: new Style({
      stroke: line(overlay, 2),
      image: new CircleStyle({ radius: POINT_RADIUS * scale, stroke: line(overlay, 2) }),
    }),
    source: new Style({ image: cross }),
    way: new Style({ stroke: line(text, 2) }),
    disagreement: new Style({ stroke: line(text, 2, [6, 5]) }),
  };
  return (feature) => {
    const mark = feature.get('mark') as AlignMark;
    if (mark !== 'target') return plain[mark];
    const label = new Text({ ...name, text: feature.get('name') as string });
    return new Style({ image: disc, text: label });
  };
}
