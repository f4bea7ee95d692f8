import { expect, type Page } from '@playwright/test';
import { PNG } from 'pngjs';

import type { Site } from './site.js';

/** Metres in the map's own frame. */
export type Place = readonly [x: number, y: number];

interface Pixel {
  x: number;
  y: number;
}

export interface OpenOptions {
  map?: string;
  /** Layers that are shown, all others are not. Default: as the page has it. */
  layers?: string[];
  /** The middle of the map, and metres a pixel. Default: all of the map. */
  view?: readonly [x: number, y: number, resolution: number];
  /** As of this revision. Default: live. */
  at?: bigint;
}

/** The dashboard as one page shows it. */
export class Dashboard {
  constructor(readonly page: Page) {}

  /** Opens the dashboard and waits until the map is live. */
  async open(site: Site, { map = 'office', layers, view, at }: OpenOptions = {}): Promise<void> {
    const params = [`map=${map}`];
    if (layers) params.push(`layers=${layers.join(',')}`);
    if (view) params.push(`view=${view.join(',')}`);
    if (at !== undefined) params.push(`at=${at}`);
    await this.page.goto(`${site.url}/?${params.join('&')}`);
    await this.isLive();
    await expect.poll(() => this.page.url()).toContain('view=');
    // Before it was drawn once, the map takes no clicks.
    await expect(this.page.locator('.map canvas').first()).toBeAttached();
    // Browsers drop them until the first picture of the page is there.
    await this.page.waitForFunction(() => performance.getEntriesByType('paint').length > 0);
  }

  async isLive(): Promise<void> {
    await this.stands('Live');
  }

  /** Waits until the page says so of its connection. */
  async stands(words: string): Promise<void> {
    await expect(this.page.getByRole('status', { name: 'Connection' })).toHaveText(words);
  }

  /** Opens a panel by its tab. */
  async panel(title: string): Promise<void> {
    const tab = this.page.getByRole('button', { name: title, exact: true });
    if ((await tab.getAttribute('aria-pressed')) !== 'true') await tab.click();
  }

  /** Where a place is on the screen: the page's address tells what the map shows. */
  at([x, y]: Place): Pixel {
    const text = new URL(this.page.url()).searchParams.get('view') ?? '';
    const [centreX = NaN, centreY = NaN, resolution = NaN] = text.split(',').map(Number);
    const { width, height } = this.page.viewportSize() ?? { width: NaN, height: NaN };
    return {
      x: width / 2 + (x - centreX) / resolution,
      y: height / 2 - (y - centreY) / resolution,
    };
  }

  async click(place: Place): Promise<void> {
    const { x, y } = this.at(place);
    await this.page.mouse.click(x, y);
  }

  async drag(from: Place, to: Place): Promise<void> {
    const [start, end] = [this.at(from), this.at(to)];
    await this.page.mouse.move(start.x, start.y);
    await this.page.mouse.down();
    await this.page.mouse.move(end.x, end.y, { steps: 5 });
    await this.page.mouse.up();
  }

  /** Clicks the corners of a polygon, and the last one once more, which ends it. */
  async draw(corners: readonly Place[]): Promise<void> {
    for (const corner of corners) await this.click(corner);
    const last = corners.at(-1);
    if (last) await this.click(last);
  }

  /** What is painted at a place: "red,green,blue". */
  async colourAt(place: Place): Promise<string> {
    const { x, y } = this.at(place);
    const clip = { x: Math.round(x), y: Math.round(y), width: 1, height: 1 };
    const { data } = PNG.sync.read(await this.page.screenshot({ clip }));
    return [...data.subarray(0, 3)].join(',');
  }
}
