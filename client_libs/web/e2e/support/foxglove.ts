import type { SceneUpdate } from '@foxglove/schemas';
import type { LayerPart, Object$, Ring } from '@hypermap/client';
import type { Page } from '@playwright/test';
import { fileURLToPath } from 'node:url';
import { build } from 'vite';

import type { Received } from '../pages/foxglove/viewer.js';
import type { Place } from './dashboard.js';
import { buildFolder } from './places.js';
import { Server } from './programs.js';
import type { Site } from './site.js';

const viewerFolder = `${buildFolder}/e2e/foxglove_viewer`;

/** Builds the viewer: pages/foxglove with Foxglove's client. */
export async function buildViewer(): Promise<void> {
  await build({
    configFile: false,
    root: fileURLToPath(new URL('../pages/foxglove', import.meta.url)),
    logLevel: 'warn',
    build: { outDir: viewerFolder, emptyOutDir: true, modulePreload: false },
  });
}

/** Starts a gateway of a site that serves the viewer in place of the dashboard. */
export function serveViewer(site: Site): Promise<Server> {
  return Server.start('hypermap-gateway', [
    `--server=${site.address}`,
    '--listen=127.0.0.1:0',
    `--dashboard=${viewerFolder}`,
  ]);
}

export interface ViewerOptions {
  map: string;
  subprotocol: string;
  /** The topics that the viewer receives but does not draw. */
  hidden?: string[];
}

/** Opens the viewer that a gateway serves, and the viewer a connection to this gateway. */
export async function openViewer(
  page: Page,
  gateway: Server,
  { map, subprotocol, hidden = [] }: ViewerOptions,
): Promise<void> {
  const params = new URLSearchParams({ map, subprotocol, hidden: hidden.join(',') });
  await page.goto(`${gateway.address}/?${params}`);
}

interface ViewerWindow extends Window {
  received: Received;
}

/** What the viewer has received until now. */
export function received(page: Page): Promise<Received> {
  return page.evaluate(() => (window as unknown as ViewerWindow).received);
}

/** The topics of which the viewer has received something, and what the gateway complained about. */
export function receivedTopics(page: Page): Promise<{ topics: string[]; problems: string[] }> {
  return page.evaluate(() => {
    const { grids, scenes, transforms, problems } = (window as unknown as ViewerWindow).received;
    const topics = [...Object.keys(grids), ...Object.keys(scenes)].sort();
    return { topics: transforms ? [...topics, '/transforms'] : topics, problems };
  });
}

/** An object of a scene: its id, its label, and the points of its rings or line, or its point. */
export interface Sketch {
  id: string;
  label: string;
  lines: Place[][];
  points: Place[];
}

/** The objects of a message of the gateway. */
export function sketchesOfMessage({ entities }: SceneUpdate): Sketch[] {
  return entities.map(({ id, texts, lines, spheres }) => ({
    id,
    label: texts.map(({ text }) => text).join(),
    lines: lines.map(({ points }) => points.map(({ x, y }): Place => [x, y])),
    points: spheres.map(({ pose }): Place => [pose.position.x, pose.position.y]),
  }));
}

/** The objects of an answer of the server. */
export function sketchesOfAnswer(parts: readonly LayerPart[]): Sketch[] {
  return parts.flatMap(({ objects }) => objects).map(sketchOf);
}

function sketchOf({ id, label, shape: placed }: Object$): Sketch {
  const shape = placed?.shape;
  const line = ({ xs, ys }: Pick<Ring, 'xs' | 'ys'>) => xs.map((x, i): Place => [x, ys[i] ?? NaN]);
  const sketch: Sketch = { id: `${id}`, label, lines: [], points: [] };
  if (shape?.case === 'point') sketch.points.push([shape.value.x, shape.value.y]);
  if (shape?.case === 'lineString') sketch.lines.push(line(shape.value));
  if (shape?.case === 'polygon') {
    const { outer, holes } = shape.value;
    sketch.lines.push(...[outer, ...holes].flatMap((ring) => (ring ? [line(ring)] : [])));
  }
  return sketch;
}
