import { describe, expect, test } from 'vitest';
import expectedColours from '../../../../testing/class_colours.json';
import { classColour, classTextColour, colourAt, floorRamp, oklch, type Rgb } from './colours';

const COCO =
  'person bicycle car truck bench backpack suitcase bottle cup fork knife bowl chair couch'
    .split(' ')
    .concat([
      'potted plant',
      'bed',
      'dining table',
      'tv',
      'laptop',
      'book',
      'refrigerator',
      'vase',
    ]);

// https://www.w3.org/TR/WCAG21/#dfn-contrast-ratio
function contrast(a: Rgb, b: Rgb): number {
  const luminance = (rgb: Rgb) => {
    const [r = 0, g = 0, b = 0] = rgb.map((v) => {
      const x = v / 255;
      return x <= 0.04045 ? x / 12.92 : ((x + 0.055) / 1.055) ** 2.4;
    });
    return 0.2126 * r + 0.7152 * g + 0.0722 * b;
  };
  const [low = 0, high = 0] = [luminance(a), luminance(b)].sort((x, y) => x - y);
  return (high + 0.05) / (low + 0.05);
}

describe('class colours', () => {
  // Users know these colours and have screenshots of them, so they must not change by accident. The
  // gateway and hypermap-ros2 read the same table in their tests.
  test.each(Object.entries(expectedColours))('%j has the colour %j', (label, colour) => {
    expect(classColour(label, false)).toEqual(colour);
  });

  test.each([
    [false, [255, 255, 255] as const],
    [true, [34, 40, 49] as const],
  ])('stand out from free floor (dark: %s)', (dark, floor) => {
    for (const label of COCO) {
      expect(contrast(classColour(label, dark), floor), label).toBeGreaterThan(3);
      expect(contrast(classTextColour(label, dark), floor), label).toBeGreaterThan(7);
    }
  });
});

test('white, black and grey have no hue', () => {
  expect(oklch(1, 0, 0)).toEqual([255, 255, 255]);
  expect(oklch(0, 0, 90)).toEqual([0, 0, 0]);
  const [r, g, b] = oklch(0.6, 0, 200);
  expect([g, b]).toEqual([r, r]);
});

test('a ramp has its end colours at and beyond its ends', () => {
  const ramp = floorRamp(false);
  expect(colourAt(ramp, 0)).toEqual([255, 255, 255, 255]);
  expect(colourAt(ramp, 1)).toEqual([52, 60, 72, 255]);
  expect(colourAt(ramp, -3)).toEqual(colourAt(ramp, 0));
  expect(colourAt(ramp, 9)).toEqual(colourAt(ramp, 1));
});
