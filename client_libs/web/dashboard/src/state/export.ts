// Exports the shown map as a file.
import { backupMap, exportMap, FileFormat, type MapFile } from '@hypermap/client';
import { zip } from 'fflate';
import { client } from './connection';
import { LayerKind, type Layer } from './model';

export type ExportFormat = 'gpkg' | 'hmap' | 'geojson' | 'nav2';

export interface Export {
  file: MapFile;
  /** One line for each part of the map that the format can't represent. */
  omissions: readonly string[];
}

export interface Wanted {
  map: string;
  format: ExportFormat;
  /** Empty for all layers that the format can represent. */
  layers: readonly string[];
}

const FORMATS: Record<Exclude<ExportFormat, 'gpkg'>, FileFormat> = {
  hmap: FileFormat.HMAP,
  geojson: FileFormat.GEOJSON,
  nav2: FileFormat.NAV2,
};

/** Whether the format can represent a layer. */
export function canCarry(format: ExportFormat, { kind, properties }: Layer): boolean {
  // The server exports layers of this kind only, whatever the cells of others are like.
  if (format === 'nav2') return kind === LayerKind.OCCUPANCY;
  return format !== 'geojson' || properties?.hasShapes === true;
}

/** Exports a map as one file. If the format consists of several files, they are zipped. */
export async function exportFile(
  { map, format, layers }: Wanted,
  signal: AbortSignal,
): Promise<Export> {
  if (format === 'gpkg') {
    return { file: await backupMap(client.value, map, { signal }), omissions: [] };
  }
  const request = { map, format: FORMATS[format], layers: [...layers] };
  const { files, omissions } = await exportMap(client.value, request, { signal });
  const [file, ...more] = files;
  if (!file) throw new Error('the server sent no file');
  return { file: more.length > 0 ? await zipped(`${map}_${format}`, files) : file, omissions };
}

async function zipped(name: string, files: readonly MapFile[]): Promise<MapFile> {
  const entries = await Promise.all(
    files.map(async (file) => [file.name, new Uint8Array(await file.data.arrayBuffer())] as const),
  );
  const bytes = await new Promise<Uint8Array>((resolve, reject) => {
    zip(Object.fromEntries(entries), (error, data) => (error ? reject(error) : resolve(data)));
  });
  return { name: `${name}.zip`, data: new Blob([bytes as BlobPart], { type: 'application/zip' }) };
}
