import View from 'ol/View';
import { afterEach, beforeEach, expect, test, vi } from 'vitest';
import { isPageMoving } from './motion';
import { planar } from './projection';
import { zoomBy } from './zoom';

vi.hoisted(() => vi.stubGlobal('matchMedia', () => ({ matches: false })));

/** The duration of a frame, milliseconds. */
let frameMs = 16;

beforeEach(() => {
  vi.useFakeTimers();
  vi.stubGlobal('requestAnimationFrame', (draw: () => void) => setTimeout(draw, frameMs));
  vi.stubGlobal('cancelAnimationFrame', (frame: number) => clearTimeout(frame));
});
afterEach(() => vi.useRealTimers());

const START = 0.06;

function viewAt(resolution: number): View {
  return new View({
    projection: planar,
    center: [0, 0],
    resolution,
    minResolution: 0.01,
    maxResolution: 10.24,
  });
}

/** The resolution after steps that follow each other at an interval, once the map is at rest. */
function resolutionAfter(steps: readonly number[], intervalMs: number, start = START): number {
  const view = viewAt(start);
  for (const step of steps) {
    zoomBy(view, step);
    vi.advanceTimersByTime(intervalMs);
  }
  vi.advanceTimersByTime(5000);
  expect(view.getAnimating()).toBe(false);
  expect(isPageMoving()).toBe(false);
  return view.getResolution() ?? NaN;
}

// Frames of 500 ms are longer than a whole step, as on a busy machine.
for (const frame of [16, 500]) {
  test.each([0, 1, 50, 150, 190, 199, 200, 250, 1000])(
    `a step in and a step out cancel out, %i ms apart with frames of ${frame} ms`,
    (intervalMs) => {
      frameMs = frame;
      expect(resolutionAfter([1, -1], intervalMs)).toBeCloseTo(START, 12);
    },
  );

  test.each([0, 100, 300])(
    `steps in one direction add up, %i ms apart with frames of ${frame} ms`,
    (intervalMs) => {
      frameMs = frame;
      expect(resolutionAfter([-1, -1, -1], intervalMs)).toBeCloseTo(8 * START, 12);
    },
  );
}

test('steps beyond the finest resolution are not remembered', () => {
  frameMs = 16;
  expect(resolutionAfter([1, 1, 1, 1, 1, -1], 10, 0.03)).toBeCloseTo(0.02, 12);
});

test('a step after an interrupted one starts from what is shown', () => {
  frameMs = 16;
  const view = viewAt(START);
  zoomBy(view, 1);
  vi.advanceTimersByTime(50);
  // The wheel interaction also cancels the animation and sets the resolution.
  view.cancelAnimations();
  view.setResolution(1);
  vi.advanceTimersByTime(50);
  zoomBy(view, 1);
  vi.advanceTimersByTime(1000);
  expect(view.getResolution()).toBeCloseTo(0.5, 12);
});
