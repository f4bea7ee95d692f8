import {
  create,
  LayerSchema,
  type MessageInitShape,
  type LayerPropertiesSchema,
} from '@hypermap/client';
import { describe, expect, test } from 'vitest';
import { contentOf, groupTitle, searchableValues, valueRange, wordOfValue } from './layer_content';

const layer = (properties: MessageInitShape<typeof LayerPropertiesSchema>) =>
  create(LayerSchema, { name: 'some', properties });

const unit = { min: 0, max: 1 };
const floor = layer({
  hasCells: true,
  valueRange: unit,
  words: ['free', 'occupied', 'unknown'],
});
const explored = layer({
  hasCells: true,
  valueRange: unit,
  words: ['explored', 'unexplored', 'unknown'],
  isBinary: true,
  wordsOfValues: [
    { word: 'unexplored', value: 0 },
    { word: 'explored', value: 1 },
  ],
});
const wifi = layer({ hasCells: true, unit: 'dBm', words: ['unknown'] });
const objects = layer({ hasShapes: true });

test('content is recognized by properties', () => {
  expect([floor, explored, wifi, objects].map(contentOf)).toEqual([
    'floor',
    'binary',
    'measurements',
    'objects',
  ]);
  expect([floor, explored, wifi, objects].map(groupTitle)).toEqual([
    'Occupancy',
    'Explored area',
    'Measurements',
    'Objects',
  ]);
});

describe('a kind of grid that the dashboard does not know', () => {
  const humidity = layer({ hasCells: true, unit: '%', valueRange: { min: 0, max: 100 } });
  const cleaned = layer({
    hasCells: true,
    isBinary: true,
    wordsOfValues: [
      { word: 'cleaned', value: 1 },
      { word: 'dirty', value: 0 },
    ],
  });
  const unnamed = layer({ hasCells: true, isBinary: true, words: ['unknown'] });

  test('is listed with those that resemble it', () => {
    expect([humidity, cleaned, unnamed].map(groupTitle)).toEqual([
      'Measurements',
      'Cleaned area',
      'Marked area',
    ]);
  });

  test('has the words of its values', () => {
    expect([0, 1, 2].map((value) => wordOfValue(cleaned, value))).toEqual([
      'dirty',
      'cleaned',
      undefined,
    ]);
    expect(wordOfValue(unnamed, 1)).toBeUndefined();
  });

  test('has the range of its properties', () => {
    expect(valueRange(humidity)).toEqual({ min: 0, max: 100 });
    expect(valueRange(cleaned)).toBeUndefined();
  });
});

test('words and an example of a comparison can be searched', () => {
  expect(searchableValues(floor)).toEqual(['free', 'occupied', 'unknown', '>0.5']);
  expect(searchableValues(explored)).toEqual(['explored', 'unexplored', 'unknown']);
  expect(searchableValues(wifi)).toEqual(['unknown']);
  expect(searchableValues(objects)).toEqual([]);
});
