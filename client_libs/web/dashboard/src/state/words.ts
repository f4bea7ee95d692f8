// Texts for cell values, answers, measures and times.
import { contentOf, wordOfValue } from './layer_content';
import { AnswerStatus, type Layer, type Object$ } from './model';
import { areaOf, kindOf, lengthOf, type KindOfShape } from './shapes';

const FREE_BELOW = 0.196;
const OCCUPIED_ABOVE = 0.65;

/** The word of a layer for a probability of occupation. */
export function occupancyWord({ thresholds }: Layer, p: number): string {
  if (p < (thresholds?.freeBelow ?? FREE_BELOW)) return 'free';
  return p > (thresholds?.occupiedAbove ?? OCCUPIED_ABOVE) ? 'occupied' : 'undecided';
}

/** The value of a cell as text. */
export function cellWords(layer: Layer, value: number): string {
  switch (contentOf(layer)) {
    case 'floor':
      return `${occupancyWord(layer, value)} (${percent(value)})`;
    case 'binary':
      return wordOfValue(layer, value) ?? numberWithUnit(layer, value);
    default:
      return numberWithUnit(layer, value);
  }
}

/** Four digits of a number with the unit of the layer: "-61.23 dBm". */
function numberWithUnit({ properties }: Layer, value: number): string {
  return `${Number(value.toPrecision(4))} ${properties?.unit ?? ''}`.trim();
}

const STATUS_WORDS: Record<AnswerStatus, string> = {
  [AnswerStatus.UNSPECIFIED]: '',
  [AnswerStatus.VALUE]: '',
  [AnswerStatus.UNKNOWN]: 'unknown',
  [AnswerStatus.OUTSIDE]: 'outside the layer',
  [AnswerStatus.NO_TRANSFORM]: 'no transform to its frame',
  [AnswerStatus.UNSUPPORTED_VALUE]: 'does not support this value',
  [AnswerStatus.DAMAGED]: 'is damaged and can’t be read',
};

export function statusWords(status: AnswerStatus): string {
  return STATUS_WORDS[status];
}

/** Formats a probability. Only exact 0 and 1 become "0 %" and "100 %". */
export function percent(p: number): string {
  const rounded = Math.round(p * 100);
  if (rounded === 0 && p > 0) return '< 1 %';
  if (rounded === 100 && p < 1) return '> 99 %';
  return `${rounded} %`;
}

export function squareMetres(area: number): string {
  const digits = area < 10 ? 2 : area < 100 ? 1 : 0;
  const options = { minimumFractionDigits: digits, maximumFractionDigits: digits };
  return `${area.toLocaleString('en', options)} m²`;
}

export function metres(length: number): string {
  return `${length.toFixed(2)} m`;
}

/** Formats an angle that is given in radians. */
export function degrees(angle: number): string {
  return `${((angle * 180) / Math.PI).toFixed(2)}°`;
}

const SHAPE_WORDS: Record<KindOfShape, string> = {
  polygon: 'polygon',
  lineString: 'line',
  point: 'point',
};

/** The kind of a shape as a word. */
export function shapeWord(kind: KindOfShape): string {
  return SHAPE_WORDS[kind];
}

/** The area of a polygon or the length of a line. Empty for a point. */
export function sizeWords(object: Object$): string {
  const kind = kindOf(object);
  if (kind === 'polygon') return squareMetres(areaOf(object));
  return kind === 'lineString' ? metres(lengthOf(object)) : '';
}

/** The kind of an object's shape and its size: "line, 4.20 m". */
export function shapeWords(object: Object$): string {
  const kind = kindOf(object);
  return [kind && shapeWord(kind), sizeWords(object)].filter(Boolean).join(', ');
}

/** Formats a count with its noun: "1 cell", "3 cells". */
export function count(n: number, one: string, many: string): string {
  return `${n.toLocaleString('en')} ${n === 1 ? one : many}`;
}

/** Formats how long before `now` a time is. */
export function ago(time: Date, now: Date): string {
  const seconds = Math.max(0, (now.getTime() - time.getTime()) / 1000);
  if (seconds < 60) return 'just now';
  if (seconds < 3600) return `${Math.floor(seconds / 60)} min ago`;
  if (seconds < 86400) return `${Math.floor(seconds / 3600)} h ago`;
  return `on ${time.toLocaleDateString()}`;
}

/** The author of a commit: a name, or a peer address without its scheme and port. */
export function authorWords(author: string): string {
  return author.replace(/^ipv[46]:(.*):\d+$/, '$1');
}
