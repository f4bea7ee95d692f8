import type { FeatureLike } from 'ol/Feature';
import Fill from 'ol/style/Fill';
import Stroke from 'ol/style/Stroke';
import Style from 'ol/style/Style';
import Text from 'ol/style/Text';
import { classTextColour, css } from './colours';
import type { Look } from './look';

/** Objects below this size have no label, pixels before scaling for large screens. */
const SMALLEST = 28;
const SIZE = 11;

type LabelStyle = (feature: FeatureLike, resolution: number) => Style | undefined;

/** Labels objects that are large enough on the screen. */
export function labelStyle({ dark, scale }: Look): LabelStyle {
  const ground = dark ? 'rgba(15,18,23,.85)' : 'rgba(255,255,255,.9)';
  const halo = new Stroke({ color: ground, width: 3 * scale });
  const font = `600 ${SIZE * scale}px system-ui, sans-serif`;
  const styles = new Map<string, Style>();
  return (feature, resolution) => {
    const [minX = 0, minY = 0, maxX = 0, maxY = 0] = feature.getGeometry()?.getExtent() ?? [];
    if (Math.max(maxX - minX, maxY - minY) < SMALLEST * scale * resolution) return undefined;
    const label = feature.get('label') as string;
    // The area of an exploration is known by its outline, and its centre is needed for goals.
    if (label === 'exploration') return undefined;
    let style = styles.get(label);
    if (!style) {
      const fill = new Fill({ color: css(classTextColour(label, dark)) });
      style = new Style({
        text: new Text({ text: label, font, fill, stroke: halo, overflow: true }),
      });
      styles.set(label, style);
    }
    return style;
  };
}
