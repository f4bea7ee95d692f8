import CircleStyle from 'ol/style/Circle';
import Fill from 'ol/style/Fill';
import Stroke from 'ol/style/Stroke';
import Style from 'ol/style/Style';
import MultiPoint from 'ol/geom/MultiPoint';
import Polygon from 'ol/geom/Polygon';

const accent = '#2f6fde';

const vertex = new CircleStyle({
  radius: 5,
  fill: new Fill({ color: '#fff' }),
  stroke: new Stroke({ color: accent, width: 2 }),
});

/** Of what is being drawn: a line, a light area, and handles at the vertices. */
export const toolStyle = [
  new Style({
    fill: new Fill({ color: 'rgba(47,111,222,.14)' }),
    stroke: new Stroke({ color: accent, width: 2 }),
    image: vertex,
  }),
  new Style({
    image: vertex,
    geometry: (feature) => {
      const geometry = feature.getGeometry();
      return geometry instanceof Polygon
        ? new MultiPoint(geometry.getCoordinates().flat())
        : undefined;
    },
  }),
];
