// Colours of classes and cells. They depend on names and values alone, so every page shows the
// same.

/** Red, green and blue in 0..255. */
export type Rgb = readonly [number, number, number];

export function css([r, g, b]: Rgb, alpha = 1): string {
  return `rgba(${r}, ${g}, ${b}, ${alpha})`;
}

/** Converts from OKLCH, where equal steps look equal: https://bottosson.github.io/posts/oklab/ */
export function oklch(lightness: number, chroma: number, hueDegrees: number): Rgb {
  const hue = (hueDegrees * Math.PI) / 180;
  const a = chroma * Math.cos(hue);
  const b = chroma * Math.sin(hue);
  const l = (lightness + 0.3963377774 * a + 0.2158037573 * b) ** 3;
  const m = (lightness - 0.1055613458 * a - 0.0638541728 * b) ** 3;
  const s = (lightness - 0.0894841775 * a - 1.291485548 * b) ** 3;
  return [
    srgb(4.0767416621 * l - 3.3077115913 * m + 0.2309699292 * s),
    srgb(-1.2684380046 * l + 2.6097574011 * m - 0.3413193965 * s),
    srgb(-0.0041960863 * l - 0.7034186147 * m + 1.707614701 * s),
  ];
}

function srgb(linear: number): number {
  const x = Math.min(1, Math.max(0, linear));
  return Math.round(255 * (x <= 0.0031308 ? 12.92 * x : 1.055 * x ** (1 / 2.4) - 0.055));
}

const utf8 = new TextEncoder();

// FNV-1a, which distributes short words well.
function hash(text: string): number {
  let h = 0x811c9dc5;
  for (const byte of utf8.encode(text)) h = Math.imul(h ^ byte, 0x01000193);
  return h >>> 0;
}

/**
 * Lowers the letters of ASCII and removes its white space at both ends. The programs in other
 * languages that give classes these colours can do this, too.
 */
function normalized(label: string): string {
  const trimmed = label.replace(/^[\t-\r ]+|[\t-\r ]+$/g, '');
  return trimmed.replace(/[A-Z]+/g, (letters) => letters.toLowerCase());
}

const HUES = 24;

function classHue(label: string): { hue: number; shade: number } {
  const h = hash(normalized(label));
  return { hue: (h % HUES) * (360 / HUES), shade: ((h >>> 8) % 3) * 0.06 };
}

/** The colour of a class, derived from its name; light on a dark page, dark on a light one. */
export function classColour(label: string, dark: boolean): Rgb {
  const { hue, shade } = classHue(label);
  return dark ? oklch(0.72 + shade, 0.14, hue) : oklch(0.5 + shade, 0.15, hue);
}

/** The text colour of a class, legible on the class's own colour. */
export function classTextColour(label: string, dark: boolean): Rgb {
  const { hue } = classHue(label);
  return dark ? oklch(0.95, 0.03, hue) : oklch(0.36, 0.1, hue);
}

export interface Ramp {
  /** Colours for equal steps from the lowest value to the highest. */
  stops: readonly Rgb[];
  /** The opacity of each stop, in [0, 1]. */
  alphas: readonly number[];
}

/** From certainly free to certainly occupied. Probably occupied cells are lighter than walls. */
export function floorRamp(dark: boolean): Ramp {
  const stops: Rgb[] = dark
    ? [
        [34, 40, 49],
        [46, 54, 65],
        [64, 74, 88],
        [100, 112, 128],
        [190, 201, 214],
      ]
    : [
        [255, 255, 255],
        [240, 242, 245],
        [216, 221, 228],
        [172, 180, 190],
        [52, 60, 72],
      ];
  return { stops, alphas: [1, 1, 1, 1, 1] };
}

/** From the lower of two values (unexplored) to the upper one (explored). */
export function binaryRamp(dark: boolean): Ramp {
  const stops: Rgb[] = dark
    ? [oklch(0.55, 0.12, 300), oklch(0.75, 0.12, 165)]
    : [oklch(0.62, 0.12, 300), oklch(0.78, 0.1, 165)];
  return { stops, alphas: [0.6, 0.35] };
}

/** For measured values: viridis, which is legible with colour vision deficiencies. */
export const MEASUREMENTS_RAMP: Ramp = {
  stops: [
    [68, 1, 84],
    [59, 82, 139],
    [33, 145, 140],
    [94, 201, 98],
    [253, 231, 37],
  ],
  alphas: [1, 1, 1, 1, 1],
};

/** The colour at a position in [0, 1] of a ramp: red, green, blue and alpha in 0..255. */
export function colourAt({ stops, alphas }: Ramp, place: number): [number, number, number, number] {
  const at = Math.min(1, Math.max(0, place)) * (stops.length - 1);
  const below = Math.min(Math.floor(at), stops.length - 2);
  const t = at - below;
  const [from, to] = [stops[below] ?? [0, 0, 0], stops[below + 1] ?? [0, 0, 0]];
  const mix = (a = 0, b = 0) => Math.round(a + (b - a) * t);
  const alpha = mix((alphas[below] ?? 1) * 255, (alphas[below + 1] ?? 1) * 255);
  return [mix(from[0], to[0]), mix(from[1], to[1]), mix(from[2], to[2]), alpha];
}
