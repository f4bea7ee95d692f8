import type { FeatureLike } from 'ol/Feature';
import type { Type } from 'ol/geom/Geometry';
import Fill from 'ol/style/Fill';
import Stroke from 'ol/style/Stroke';
import Style from 'ol/style/Style';
import Text from 'ol/style/Text';
import { classTextColour, css } from './colours';
import type { Look } from './look';

/** Polygons and lines below this size have no label, pixels before scaling for large screens. */
const SMALLEST = 28;
const SIZE = 11;
/** The distance from a point or a line up to its label, pixels before scaling for large screens. */
const ABOVE: Partial<Record<Type, number>> = { Point: 15, LineString: 11 };

type LabelStyle = (feature: FeatureLike, resolution: number) => Style | undefined;

/** Labels points, and other objects that are large enough on the screen. */
export function labelStyle({ dark, scale }: Look): LabelStyle {
  const ground = dark ? 'rgba(15,18,23,.85)' : 'rgba(255,255,255,.9)';
  const halo = new Stroke({ color: ground, width: 3 * scale });
  const font = `600 ${SIZE * scale}px system-ui, sans-serif`;
  const styles = new Map<string, Style>();
  return (feature, resolution) => {
    const geometry = feature.getGeometry();
    const type = geometry?.getType();
    const [minX = 0, minY = 0, maxX = 0, maxY = 0] = geometry?.getExtent() ?? [];
    const size = Math.max(maxX - minX, maxY - minY);
    if (type !== 'Point' && size < SMALLEST * scale * resolution) return undefined;
    const label = feature.get('label') as string;
    // The area of an exploration is known by its outline, and its centre is needed for goals.
    if (label === 'exploration') return undefined;
    const key = `${type}${label}`;
    let style = styles.get(key);
    if (!style) {
      const fill = new Fill({ color: css(classTextColour(label, dark)) });
      const offsetY = -scale * ((type && ABOVE[type]) ?? 0);
      style = new Style({
        text: new Text({ text: label, font, fill, stroke: halo, overflow: true, offsetY }),
      });
      styles.set(key, style);
    }
    return style;
  };
}
