import { createGrpcTransport } from '@connectrpc/connect-node';
import { createHypermapClient, type HypermapClient } from '@hypermap/client';
import { cp, mkdtemp, rm } from 'node:fs/promises';
import { tmpdir } from 'node:os';
import { join } from 'node:path';

import { dashboardFolder, root } from './places.js';
import { run, Server } from './programs.js';

/**
 * A server with its own copy of some maps, and a gateway in front of it that serves the dashboard.
 */
export class Site {
  private opened: HypermapClient | undefined;

  private constructor(
    private readonly folder: string,
    private server: Server,
    private readonly gateway: Server,
  ) {}

  /** Serves a copy of the maps in a folder. */
  static async open(maps: string): Promise<Site> {
    const folder = await mkdtemp(join(tmpdir(), 'hypermap_e2e_'));
    await cp(maps, folder, { recursive: true });
    // Nobody else takes ports of this address while the server is down.
    const server = await serve(folder, '127.0.0.10:0');
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

  /** The URL of the dashboard, without a slash at its end. */
  get url(): string {
    return this.gateway.address;
  }

  /** The address of the server itself: HOST:PORT. */
  get address(): string {
    return this.server.address;
  }

  /** Runs the command-line client against the server. Returns its output. */
  async hypermap(...args: string[]): Promise<string> {
    return run('hypermap', ['--server', this.address, ...args]);
  }

  /** A client that is connected to the server directly, without the gateway. */
  client(): HypermapClient {
    this.opened ??= createHypermapClient(
      createGrpcTransport({ baseUrl: `http://${this.address}` }),
    );
    return this.opened;
  }

  /** Kills the server without a shutdown. */
  async killServer(): Promise<void> {
    await this.server.stop('SIGKILL');
  }

  /** Starts the server again at the same address with the same maps, and perhaps with flags. */
  async restartServer(...flags: string[]): Promise<void> {
    this.server = await serve(this.folder, this.server.address, ...flags);
  }

  /**
   * Starts the server again, which then knows one identity and nobody else. Returns the token of
   * the identity.
   */
  async requireIdentity(name: string, role: string): Promise<string> {
    const file = join(this.folder, 'access.yaml');
    const made = await run('hypermap', ['token', 'create', name, '--role', role, '--file', file]);
    await this.server.stop();
    this.server = await serve(this.folder, this.server.address, `--access_file=${file}`);
    return made.trim();
  }

  /** Stops the programs and deletes the copy of the maps. */
  async close(): Promise<void> {
    await Promise.all([this.gateway.stop(), this.server.stop()]);
    await rm(this.folder, { recursive: true, force: true });
  }
}

function serve(folder: string, listen: string, ...flags: string[]): Promise<Server> {
  return Server.start('hypermapd', [`--data_dir=${folder}`, `--listen=${listen}`, ...flags]);
}

/** Creates a folder of maps that sites can start from. */
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

/** Creates the office of the demo with layers of every kind, one of them in its own frame. */
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

/** Creates the office after three robots have explored about half of it. */
export async function drawExploredOffice(run: Hypermap): Promise<void> {
  await drawOffice(run);
  // The robots' own layer of explored floor replaces the one of the demo.
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
  // The program reports an error when the robots are stopped before the end.
  await robots.catch((error: Error) => {
    if (!error.message.includes('the exploration has not ended after 120 steps')) throw error;
  });
}
