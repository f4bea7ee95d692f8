import {
  create,
  LayerSchema,
  type MessageInitShape,
  type LayerPropertiesSchema,
} from '@hypermap/client';
import { expect, test } from 'vitest';
import { MEASUREMENTS_RAMP, binaryRamp, colourAt, floorRamp } from './colours';
import { colouringOf, GridPalette } from './grid_palette';

const colouring = (properties: MessageInitShape<typeof LayerPropertiesSchema>) =>
  colouringOf(create(LayerSchema, { name: 'some', properties: { hasCells: true, ...properties } }));

test('the colours of cells follow from the properties of their layer', () => {
  const valueRange = { min: 0, max: 1 };
  const floor = colouring({ valueRange, words: ['free', 'occupied', 'unknown'] });
  expect(floor.ramp(true)).toEqual(floorRamp(true));
  expect(floor.range).toEqual(valueRange);
  expect(colouring({ words: ['explored'], isBinary: true }).ramp(false)).toEqual(binaryRamp(false));
  expect(colouring({ unit: 'dBm' })).toMatchObject({ range: undefined });
  expect(colouring({ unit: 'dBm' }).ramp(false)).toBe(MEASUREMENTS_RAMP);
});

test('a grid of an unknown kind is coloured over the range of its values', () => {
  const { ramp, range } = colouring({ unit: '%', valueRange: { min: 0, max: 100 } });
  const palette = new GridPalette(ramp(false), range?.min ?? NaN, range?.max ?? NaN);
  const pixels = new Uint32Array(4);
  palette.paint(Float32Array.of(0, 100, 120, NaN), pixels);
  const bytes = new Uint8Array(pixels.buffer);
  const colour = (i: number) => [...bytes.subarray(4 * i, 4 * i + 4)];
  expect(colour(0)).toEqual(colourAt(MEASUREMENTS_RAMP, 0));
  expect(colour(1)).toEqual(colourAt(MEASUREMENTS_RAMP, 1));
  expect(colour(2)).toEqual(colour(1));
  expect(colour(3)).toEqual([0, 0, 0, 0]);
});
