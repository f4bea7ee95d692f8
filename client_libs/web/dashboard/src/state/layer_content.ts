// Classifies the content of layers by their properties, so that a kind of layer that the dashboard
// does not know is drawn and described like similar kinds.
import type { Layer } from './model';

/**
 * The content of a layer, as far as it is drawn and described differently: cells from free to
 * occupied, cells with one of two values, cells with any other numbers, or objects.
 */
export type Content = 'floor' | 'binary' | 'measurements' | 'objects';

/** In this order layers are drawn over each other, and within one content by name. */
export const BOTTOM_TO_TOP: readonly Content[] = ['floor', 'binary', 'measurements', 'objects'];

export function contentOf({ properties }: Layer): Content {
  if (!properties?.hasCells) return 'objects';
  const { words, isBinary } = properties;
  if (words.includes('free') && words.includes('occupied')) return 'floor';
  return isBinary ? 'binary' : 'measurements';
}

export interface Range {
  min: number;
  max: number;
}

/** The range of the values that cells of the layer can have. Undefined if it has no limits. */
export function valueRange({ properties }: Layer): Range | undefined {
  const { min, max } = properties?.valueRange ?? {};
  return min !== undefined && max !== undefined && min < max ? { min, max } : undefined;
}

const DEFAULT_RANGE: Range = { min: 0, max: 1 };

/** The two values of a binary layer. */
export function binaryValues(layer: Layer): Range {
  return valueRange(layer) ?? DEFAULT_RANGE;
}

/** The word that stands for a value, such as "explored" for 1. Undefined if there is none. */
export function wordOfValue({ properties }: Layer, value: number): string | undefined {
  return properties?.wordsOfValues.find((named) => named.value === value)?.word;
}

/** The title of the group that a layer is listed in. */
export function groupTitle(layer: Layer): string {
  switch (contentOf(layer)) {
    case 'floor':
      return 'Occupancy';
    case 'measurements':
      return 'Measurements';
    case 'objects':
      return 'Objects';
    case 'binary': {
      const word = wordOfValue(layer, binaryValues(layer).max) ?? 'marked';
      return `${word.charAt(0).toUpperCase()}${word.slice(1)} area`;
    }
  }
}

/** Values that can be searched on a layer of cells: its words, and a comparison as an example. */
export function searchableValues(layer: Layer): string[] {
  const words = layer.properties?.words ?? [];
  const range = valueRange(layer);
  if (!range || contentOf(layer) === 'binary') return [...words];
  return [...words, `>${(range.min + range.max) / 2}`];
}
