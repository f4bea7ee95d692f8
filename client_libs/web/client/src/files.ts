import type { MessageInitShape } from '@bufbuild/protobuf';
import type { CallOptions } from '@connectrpc/connect';
import type { HypermapClient } from './client.js';
import type { ExportMapRequestSchema } from './gen/hypermap/v1/catalog_service_pb.js';

export interface MapFile {
  name: string;
  data: Blob;
}

export interface ExportedMap {
  revision: bigint;
  /** The incarnation of the map to which the revision belongs. */
  incarnation: bigint;
  /** One line for each part of the map that the format can't represent. */
  omissions: string[];
  files: MapFile[];
}

/** Exports a map, or some of its layers, as interchange files. */
export async function exportMap(
  client: HypermapClient,
  request: MessageInitShape<typeof ExportMapRequestSchema>,
  options?: CallOptions,
): Promise<ExportedMap> {
  let revision = 0n;
  let incarnation = 0n;
  let omissions: string[] = [];
  const pieces = new Map<string, BlobPart[]>();
  for await (const { part } of client.catalog.exportMap(request, options)) {
    if (part.case === 'header') {
      ({ revision, incarnation, omissions } = part.value);
    } else if (part.case === 'chunk') {
      const { fileName, data } = part.value;
      const file = pieces.get(fileName) ?? [];
      file.push(data as BlobPart);
      pieces.set(fileName, file);
    }
  }
  const files = Array.from(pieces, ([name, parts]) => ({ name, data: new Blob(parts) }));
  return { revision, incarnation, omissions, files };
}

/** Returns a copy of the map as the server stores it: a GeoPackage. */
export async function backupMap(
  client: HypermapClient,
  map: string,
  options?: CallOptions,
): Promise<MapFile> {
  const parts: BlobPart[] = [];
  for await (const { data } of client.catalog.backupMap({ map }, options)) {
    parts.push(data as BlobPart);
  }
  return { name: `${map}.gpkg`, data: new Blob(parts, { type: 'application/geopackage+sqlite3' }) };
}
