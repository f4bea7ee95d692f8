import { expect, test } from 'vitest';
import { formatLength, roundLength } from './lengths';

test.each([
  [0.0119, 0.01, '1 cm'],
  [0.3, 0.2, '20 cm'],
  [0.999, 0.5, '50 cm'],
  [1, 1, '1 m'],
  [7.3, 5, '5 m'],
  [240, 200, '200 m'],
  [1200, 1000, '1 km'],
])('at most %d m are %d m, written %s', (longest, length, text) => {
  expect(roundLength(longest)).toBeCloseTo(length);
  expect(formatLength(roundLength(longest))).toBe(text);
});
