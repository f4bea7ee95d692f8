import type { Page } from '@playwright/test';

import type { Place } from '../support/dashboard.js';
import { putSquare } from '../support/edits.js';
import { printFigures, quantile } from '../support/figures.js';
import { expect, test } from '../support/test.js';

const EDITS = 50;

interface Seen {
  colour: string;
  /** The start of the frame after the one that painted it, milliseconds since the epoch. */
  at: number;
}

declare global {
  interface Window {
    seen: Seen[];
  }
}

/** Records in the page when the map's pixel at a place changes. */
async function watchPixel(page: Page, { x, y }: { x: number; y: number }): Promise<void> {
  await page.evaluate(
    ([left, top]) => {
      const canvas = document.createElement('canvas');
      canvas.width = canvas.height = 1;
      const context = canvas.getContext('2d', { willReadFrequently: true });
      const painted = (): string => {
        context?.clearRect(0, 0, 1, 1);
        for (const layer of document.querySelectorAll('canvas')) {
          const box = layer.getBoundingClientRect();
          if (box.width === 0) continue;
          const scale = layer.width / box.width;
          const [sx, sy] = [(left - box.left) * scale, (top - box.top) * scale];
          context?.drawImage(layer, sx, sy, 1, 1, 0, 0, 1, 1);
        }
        return String(context?.getImageData(0, 0, 1, 1).data);
      };
      window.seen = [{ colour: painted(), at: performance.timeOrigin + performance.now() }];
      let before = window.seen[0]?.colour;
      const look = (time: number): void => {
        const last = window.seen.at(-1);
        if (before !== undefined && before !== last?.colour) {
          window.seen.push({ colour: before, at: performance.timeOrigin + time });
        }
        before = painted();
        requestAnimationFrame(look);
      };
      requestAnimationFrame(look);
    },
    [x, y] as const,
  );
}

/** Returns the pixel's colour once it has not changed for a while. */
async function settledColour(page: Page): Promise<string> {
  const settled = await page.waitForFunction(() => {
    const last = window.seen.at(-1);
    const now = performance.timeOrigin + performance.now();
    return last && now - last.at > 300 ? last.colour : undefined;
  });
  return String(await settled.jsonValue());
}

/** Waits until the pixel has a colour. Returns the time at which it was painted. */
async function timeOf(page: Page, colour: string, after: number): Promise<number> {
  const since = await page.waitForFunction(
    ([wanted, begin]) => window.seen.slice(begin).find((seen) => seen.colour === wanted)?.at,
    [colour, after] as const,
  );
  return Number(await since.jsonValue());
}

test('latency from an edit to its pixels', async ({ site, dashboard, page }) => {
  const corner: Place = [6.25, 5.75];
  await dashboard.open(site, { view: [7, 6, 0.02] });
  await watchPixel(page, dashboard.at([6.3, 5.8]));
  const floor = await settledColour(page);
  const id = await putSquare(site, 'objects', 'trolley', corner);
  await page.waitForFunction((colour) => window.seen.at(-1)?.colour !== colour, floor);
  const trolley = await settledColour(page);
  await putSquare(site, 'objects', 'cup', corner, id);
  await page.waitForFunction((colour) => window.seen.at(-1)?.colour !== colour, trolley);
  const cup = await settledColour(page);

  const sinceSent: number[] = [];
  const sinceAnswered: number[] = [];
  for (let i = 0; i < EDITS; i++) {
    const [label, colour] = i % 2 ? ['cup', cup] : ['trolley', trolley];
    const changes = await page.evaluate(() => window.seen.length);
    const sent = Date.now();
    await putSquare(site, 'objects', label, corner, id);
    const answered = Date.now();
    const painted = await timeOf(page, colour, changes);
    sinceSent.push(painted - sent);
    sinceAnswered.push(painted - answered);
  }
  const told = (values: number[]) =>
    [0.5, 0.95].map((share) => `${quantile(values, share).toFixed(0)} ms`).join(' and ');
  printFigures(
    'latency',
    `change to pixel, median and p95 of ${EDITS} edits: ` +
      `${told(sinceSent)} after it was sent, ${told(sinceAnswered)} after its answer`,
  );
});

test('weight of the page and its first paint', async ({ site, dashboard, page }) => {
  const network = await page.context().newCDPSession(page);
  await network.send('Network.enable');
  let bytes = 0;
  network.on('Network.loadingFinished', ({ encodedDataLength }) => (bytes += encodedDataLength));
  await dashboard.open(site);
  const first = await page.evaluate(
    () => performance.getEntriesByName('first-contentful-paint')[0]?.startTime ?? NaN,
  );
  expect(bytes).toBeGreaterThan(0);
  const live = await page.evaluate(() => performance.now());
  printFigures(
    'page',
    `page weight ${(bytes / 1024).toFixed(0)} KiB with the first answers, ` +
      `first paint after ${first.toFixed(0)} ms, map live after less than ${live.toFixed(0)} ms`,
  );
});
