import Projection from 'ol/proj/Projection';

/** Local planar metres, as all coordinates of a map are. */
export const planar = new Projection({ code: 'hypermap:planar', units: 'm', metersPerUnit: 1 });
