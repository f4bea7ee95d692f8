import type { FeatureLike } from 'ol/Feature';
import CircleStyle from 'ol/style/Circle';
import Fill from 'ol/style/Fill';
import Stroke from 'ol/style/Stroke';
import Style from 'ol/style/Style';
import LineString from 'ol/geom/LineString';
import MultiPoint from 'ol/geom/MultiPoint';
import Polygon from 'ol/geom/Polygon';

const accent = '#2f6fde';

/**
 * The style of a shape that is being drawn: an outline, a light fill, and handles at the vertices.
 */
export function toolStyle(scale: number): Style[] {
  const line = new Stroke({ color: accent, width: 2 * scale });
  const vertex = new CircleStyle({
    radius: 5 * scale,
    fill: new Fill({ color: '#fff' }),
    stroke: line,
  });
  return [
    new Style({ fill: new Fill({ color: 'rgba(47,111,222,.14)' }), stroke: line, image: vertex }),
    new Style({ image: vertex, geometry: verticesOf }),
  ];
}

function verticesOf(feature: FeatureLike): MultiPoint | undefined {
  const geometry = feature.getGeometry();
  if (geometry instanceof Polygon) return new MultiPoint(geometry.getCoordinates().flat());
  return geometry instanceof LineString ? new MultiPoint(geometry.getCoordinates()) : undefined;
}
