import { expect, type Page } from '@playwright/test';
import { PNG } from 'pngjs';

import { Picture, type Pixel } from './picture.js';
import type { Site } from './site.js';

/** A position in metres, in the map's own frame. */
export type Place = readonly [x: number, y: number];

export interface OpenOptions {
  map?: string;
  /** The visible layers. Default: the page's own choice. */
  layers?: string[];
  /** The centre of the map and the resolution in metres per pixel. Default: the whole map. */
  view?: readonly [x: number, y: number, resolution: number];
  /** The shown revision. Default: live. */
  at?: bigint;
}

/** Operates the dashboard in one browser page. */
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
    // "Live" comes before the content: a layer is drawn when the snapshot and the list of layers
    // have come. The map ignores clicks until it has been drawn once.
    await expect(this.page.locator('.map .canvas-layer').first()).toBeAttached();
    // The browser drops input until the first paint of the page.
    await this.page.waitForFunction(() => performance.getEntriesByType('paint').length > 0);
  }

  async isLive(): Promise<void> {
    await this.hasStatus('Live');
  }

  /** Waits until the page shows this status of its connection. */
  async hasStatus(status: string): Promise<void> {
    await expect(this.page.getByRole('status', { name: 'Connection' })).toHaveText(status);
  }

  /** Opens a panel with its tab. */
  async panel(title: string): Promise<void> {
    const tab = this.page.getByRole('button', { name: title, exact: true });
    if ((await tab.getAttribute('aria-pressed')) !== 'true') await tab.click();
  }

  /** The position of a place on the screen, computed from the view in the page's address. */
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

  /** Clicks the corners of a polygon, and the last one again to end it. */
  async draw(corners: readonly Place[]): Promise<void> {
    for (const corner of corners) await this.click(corner);
    const last = corners.at(-1);
    if (last) await this.click(last);
  }

  /** Takes a picture of the page, whose colours are read at many places. */
  async picture(): Promise<Picture> {
    return new Picture(await this.page.screenshot());
  }

  /** The painted colour at a place as "red,green,blue". */
  async colourAt(place: Place): Promise<string> {
    const { x, y } = this.at(place);
    const clip = { x: Math.round(x), y: Math.round(y), width: 1, height: 1 };
    const { data } = PNG.sync.read(await this.page.screenshot({ clip }));
    return [...data.subarray(0, 3)].join(',');
  }
}
