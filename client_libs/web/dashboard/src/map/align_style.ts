import type { FeatureLike } from 'ol/Feature';
import CircleStyle from 'ol/style/Circle';
import Stroke from 'ol/style/Stroke';
import Style from 'ol/style/Style';
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

export type AlignMark = 'object';

/** Draws the objects of the overlay as outlines. */
export function alignStyle({ dark, scale }: Look): (feature: FeatureLike) => Style {
  const stroke = new Stroke({
    color: css(dark ? OVERLAY_COLOUR.dark : OVERLAY_COLOUR.light),
    width: 2 * scale,
  });
  const styles: Record<AlignMark, Style> = {
    object: new Style({
      stroke,
      image: new CircleStyle({ radius: POINT_RADIUS * scale, stroke }),
    }),
  };
  return (feature) => styles[feature.get('mark') as AlignMark];
}
