import type { Page } from '@playwright/test';

/** Statistics of the intervals between the frames of a page, milliseconds. */
export interface Frames {
  count: number;
  median: number;
  p95: number;
  longest: number;
}

interface Watched extends Window {
  frameTimes: number[];
}

/** Measures the frames during an action. */
export async function frameTimes(page: Page, act: () => Promise<void>): Promise<Frames> {
  await page.evaluate(() => {
    const watched = window as unknown as Watched;
    const times: number[] = [];
    watched.frameTimes = times;
    let last = performance.now();
    const tick = (): void => {
      if (watched.frameTimes !== times) return;
      const now = performance.now();
      times.push(now - last);
      last = now;
      requestAnimationFrame(tick);
    };
    requestAnimationFrame(tick);
  });
  await act();
  const times = await page.evaluate(() => {
    const watched = window as unknown as Watched;
    const measured = watched.frameTimes;
    watched.frameTimes = [];
    return measured;
  });
  times.sort((a, b) => a - b);
  const at = (part: number): number => times[Math.floor((times.length - 1) * part)] ?? NaN;
  return { count: times.length, median: at(0.5), p95: at(0.95), longest: at(1) };
}

export function framesText({ count, median, p95, longest }: Frames): string {
  const ms = (value: number): string => `${value.toFixed(1)} ms`;
  return `${count} frames, median ${ms(median)}, p95 ${ms(p95)}, longest ${ms(longest)}`;
}

/** Drags the map along a figure of eight, back to where it was. */
export async function panAround(page: Page): Promise<void> {
  const { width, height } = page.viewportSize() ?? { width: 0, height: 0 };
  const [x, y] = [width / 2, height / 2];
  await page.mouse.move(x, y);
  await page.mouse.down();
  const steps = 60;
  for (let i = 0; i <= steps; i++) {
    const angle = (2 * Math.PI * i) / steps;
    await page.mouse.move(x + 200 * Math.sin(angle), y + 120 * Math.sin(2 * angle));
  }
  await page.mouse.up();
}

/** Zooms in with the wheel and out again. */
export async function zoomInAndOut(page: Page): Promise<void> {
  const { width, height } = page.viewportSize() ?? { width: 0, height: 0 };
  await page.mouse.move(width / 2, height / 2);
  for (const delta of [-120, 120]) {
    for (let i = 0; i < 10; i++) {
      await page.mouse.wheel(0, delta);
      await page.evaluate(() => new Promise(requestAnimationFrame));
    }
  }
}
