import Projection from 'ol/proj/Projection';

/** The projection of all coordinates of a map: local planar metres. */
export const planar = new Projection({ code: 'hypermap:planar', units: 'm', metersPerUnit: 1 });
