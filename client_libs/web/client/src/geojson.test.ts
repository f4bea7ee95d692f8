import { create } from '@bufbuild/protobuf';
import { describe, expect, test } from 'vitest';
import { runsOf, runToGeoJson } from './cells.js';
import { ShapeSchema } from './gen/hypermap/v1/geometry_pb.js';
import { GridGeometrySchema } from './gen/hypermap/v1/layer_pb.js';
import { ObjectSchema } from './gen/hypermap/v1/object_pb.js';
import { CellRunsSchema } from './gen/hypermap/v1/query_service_pb.js';
import {
  objectToFeature,
  polygonFromGeoJson,
  shapeFromGeoJson,
  shapeToGeoJson,
  type ShapeGeometry,
} from './geojson.js';

const outer = [
  [0, 0],
  [4, 0],
  [4, 4],
  [0, 4],
];
const hole = [
  [1, 1],
  [1, 2],
  [2, 2],
];
const closed = (ring: number[][]) => [...ring, ring[0] ?? []];

describe('shapes', () => {
  test.each<[ShapeGeometry, string]>([
    [{ type: 'Polygon', coordinates: [closed(outer), closed(hole)] }, 'polygon'],
    [
      {
        type: 'LineString',
        coordinates: [
          [0, 0],
          [4, 1],
          [0, 0],
        ],
      },
      'lineString',
    ],
    [{ type: 'Point', coordinates: [3, -2.5] }, 'point'],
  ])('are converted in both directions: %j', (geometry, kind) => {
    const shape = shapeFromGeoJson(geometry);
    expect(shape.shape.case).toBe(kind);
    expect(shapeToGeoJson(shape)).toEqual(geometry);
  });

  test('ignore heights', () => {
    const at = (...coordinates: number[]) => shapeFromGeoJson({ type: 'Point', coordinates });
    expect(at(1, 2, 3)).toEqual(at(1, 2));
  });

  test('of an unknown kind have no geometry', () => {
    expect(shapeToGeoJson(create(ShapeSchema))).toBeNull();
  });

  test('are not made of other geometries', () => {
    const geometry = { type: 'MultiPoint', coordinates: [[1, 2]] } as unknown as ShapeGeometry;
    expect(() => shapeFromGeoJson(geometry)).toThrow(RangeError);
  });
});

describe('polygons', () => {
  test('have their vertices in columns, and the first one once', () => {
    const coordinates = [closed(outer), closed(hole)];
    const polygon = polygonFromGeoJson({ type: 'Polygon', coordinates });
    expect(polygon.outer).toMatchObject({ xs: [0, 4, 4, 0], ys: [0, 0, 4, 4] });
    expect(polygon.holes).toMatchObject([{ xs: [1, 1, 2], ys: [1, 2, 2] }]);
  });

  test('may have open rings, and heights', () => {
    const flat = polygonFromGeoJson({ type: 'Polygon', coordinates: [closed(outer)] });
    const tall = outer.map(([x = 0, y = 0]) => [x, y, 1.5]);
    expect(polygonFromGeoJson({ type: 'Polygon', coordinates: [tall] })).toEqual(flat);
  });

  test('must have a ring', () => {
    expect(() => polygonFromGeoJson({ type: 'Polygon', coordinates: [] })).toThrow(RangeError);
  });
});

test('an object becomes a feature', () => {
  const object = create(ObjectSchema, {
    id: 9007199254740993n,
    label: 'chair',
    classes: { chair: 0.9, couch: 0.1 },
    existence: 0.75,
    shape: shapeFromGeoJson({ type: 'Polygon', coordinates: [outer] }),
    tags: ['red'],
    attributes: {
      seats: { value: { case: 'intValue', value: 1n } },
      broken: { value: { case: 'boolValue', value: false } },
    },
    height: { lowM: 0, highM: 0.9 },
    version: 3n,
  });
  expect(objectToFeature(object, 'things')).toEqual({
    type: 'Feature',
    id: '9007199254740993',
    geometry: { type: 'Polygon', coordinates: [closed(outer)] },
    properties: {
      label: 'chair',
      classes: { chair: 0.9, couch: 0.1 },
      existence: 0.75,
      tags: ['red'],
      attributes: { seats: 1n, broken: false },
      height: { low: 0, high: 0.9 },
      version: 3n,
      layer: 'things',
    },
  });
});

test('an object without a shape becomes a feature without a geometry', () => {
  expect(objectToFeature(create(ObjectSchema, { label: 'chair' }), 'things').geometry).toBeNull();
});

test('a run of cells covers its rectangle, turned and moved as its grid', () => {
  const grid = create(GridGeometrySchema, {
    origin: { x: 10, y: 20, yaw: Math.PI / 2 },
    resolutionM: 0.5,
  });
  const cells = create(CellRunsSchema, {
    grid,
    rows: [-2],
    colBegins: [4],
    colEnds: [8],
    values: [0.25],
  });
  const runs = [...runsOf(cells)];
  expect(runs).toEqual([{ row: -2, colBegin: 4, colEnd: 8, value: 0.25 }]);
  const [ring] = runs.flatMap((run) => runToGeoJson(run, grid).coordinates);
  const expected = closed([
    [11, 22],
    [11, 24],
    [10.5, 24],
    [10.5, 22],
  ]);
  expect(ring).toHaveLength(expected.length);
  ring?.flat().forEach((value, i) => expect(value).toBeCloseTo(expected.flat()[i] ?? NaN, 12));
});
