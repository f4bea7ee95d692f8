import CircleStyle from 'ol/style/Circle';
import Stroke from 'ol/style/Stroke';
import Style from 'ol/style/Style';
import type { Look } from './look';
import { POINT_RADIUS } from './shape_paint';

/** Outlines an object thinly, so that its own colours stay visible. */
export function hoverStyle({ dark, scale }: Look): Style {
  const color = dark ? 'rgba(255,210,74,.8)' : 'rgba(217,72,15,.7)';
  const stroke = new Stroke({ color, width: 1.5 * scale });
  return new Style({
    stroke,
    image: new CircleStyle({ radius: (POINT_RADIUS + 4) * scale, stroke }),
  });
}
