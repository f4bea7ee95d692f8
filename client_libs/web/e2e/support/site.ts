import { createGrpcTransport } from '@connectrpc/connect-node';
import { createHypermapClient, type HypermapClient } from '@hypermap/client';
import { cp, mkdtemp, rm } from 'node:fs/promises';
import { tmpdir } from 'node:os';
import { join } from 'node:path';

import { dashboardFolder, root } from './places.js';
import { run, Server } from './programs.js';

/** A server with maps of its own, and the gateway that serves the dashboard before it. */
export class Site {
  private opened: HypermapClient | undefined;

  private constructor(
    private readonly folder: string,
    private server: Server,
    private readonly gateway: Server,
  ) {}

  /** Serves a copy of the maps of a folder. */
  static async open(maps: string): Promise<Site> {
    const folder = await mkdtemp(join(tmpdir(), 'hypermap_e2e_'));
    await cp(maps, folder, { recursive: true });
    const server = await serve(folder, '127.0.0.1:0');
    try {
      const gateway = await Server.start('hypermap-gateway', [
        `--server=${server.address}`,
        '--listen=127.0.0.1:0',
        `--dashboard=${dashboardFolder}`,
      ]);
      return new Site(folder, server, gateway);
    } catch (error) {
      await server.stop('SIGKILL');
      throw error;
    }
  }

  /** Of the dashboard, without a slash at its end. */
  get url(): string {
    return this.gateway.address;
  }

  /** Of the server itself: HOST:PORT. */
  get address(): string {
    return this.server.address;
  }

  /** Asks or changes the maps by the command line, as somebody else would. */
  async hypermap(...args: string[]): Promise<string> {
    return run('hypermap', ['--server', this.address, ...args]);
  }

  /** A client of the server itself, without the gateway: what other programs do. */
  client(): HypermapClient {
    this.opened ??= createHypermapClient(
      createGrpcTransport({ baseUrl: `http://${this.address}` }),
    );
    return this.opened;
  }

  /** The server is gone at once, and nobody says good-bye. */
  async killServer(): Promise<void> {
    await this.server.stop('SIGKILL');
  }

  /** The server comes back where it was. */
  async restartServer(): Promise<void> {
    this.server = await serve(this.folder, this.server.address);
  }

  async close(): Promise<void> {
    await Promise.all([this.gateway.stop(), this.server.stop()]);
    await rm(this.folder, { recursive: true, force: true });
  }
}

function serve(folder: string, listen: string): Promise<Server> {
  return Server.start('hypermapd', [`--data_dir=${folder}`, `--listen=${listen}`]);
}

/** Draws maps into a new folder, for sites to begin with. */
export async function drawMaps(draw: (hypermap: Hypermap) => Promise<void>): Promise<string> {
  const folder = await mkdtemp(join(tmpdir(), 'hypermap_e2e_maps_'));
  const server = await serve(folder, '127.0.0.1:0');
  try {
    await draw((name, ...args) => run(name, [...args, '--server', server.address]));
    return folder;
  } finally {
    await server.stop();
  }
}

/** Runs a program of the build against a server. */
export type Hypermap = (
  program: 'hypermap' | 'hypermap-ingest',
  ...args: string[]
) => Promise<string>;

/** The office of the demo, with layers of every kind, one of them in a frame of its own. */
export async function drawOffice(run: Hypermap): Promise<void> {
  const layers = [
    ['floor', '--kind', 'occupancy', '--resolution', '0.05'],
    ['seen', '--kind', 'exploration', '--resolution', '0.1'],
    ['wifi', '--kind', 'scalar', '--unit', 'dBm', '--resolution', '0.25'],
    ['objects', '--kind', 'semantic'],
    ['dock', '--kind', 'semantic', '--frame', 'dock'],
  ] as const;
  await run('hypermap', 'map', 'create', 'office');
  await run('hypermap', 'transform', 'set', 'office', 'dock', 'map', '20', '0', '1.75');
  for (const [layer, ...options] of layers) {
    await run('hypermap', 'layer', 'create', 'office', layer, ...options);
    const file = `${root}demo/office/${layer}.geojson`;
    await run('hypermap', 'edit', 'office', file, '--layer', layer);
  }
}

/** The office, and in it three robots that explore it and have come about half-way. */
export async function drawExploredOffice(run: Hypermap): Promise<void> {
  await drawOffice(run);
  // What is seen now is what they see.
  await run('hypermap', 'layer', 'delete', 'office', 'seen');
  const area = ['0.2,0.2', '14.6,0.2', '14.6,11.8', '0.2,11.8'];
  const robots = run(
    'hypermap-ingest',
    'simulate',
    ...['--map', 'office', '--occupancy', 'floor', '--objects', 'objects,dock'],
    ...['--area', ...area, '--robots', '3', '--seed', '1'],
    ...['--layer', 'found', '--explored', 'explored', '--detector', 'noisy', '--pose', 'amcl'],
    ...['--max_steps', '120'],
  );
  // They are stopped on their way, which they call an error.
  await robots.catch((error: Error) => {
    if (!error.message.includes('not at its end after 120 steps')) throw error;
  });
}
