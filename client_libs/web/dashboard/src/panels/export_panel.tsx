import { computed, signal } from '@preact/signals';
import { asking } from '../state/asking';
import { may, type RestrictedRpc } from '../state/caller';
import { canCarry, exportFile, type Export, type ExportFormat } from '../state/export';
import { layers, mapName } from '../state/site';
import { asOf } from '../state/time';
import './export_panel.css';
import { ExportIcon } from './kit/icons';
import type { Panel } from './panel';

interface Format {
  format: ExportFormat;
  name: string;
  what: string;
  needs?: RestrictedRpc;
}

const FORMATS: readonly Format[] = [
  {
    format: 'gpkg',
    name: 'GeoPackage',
    what: 'The whole map as the server stores it, for QGIS and GDAL',
    needs: 'CatalogService/BackupMap',
  },
  {
    format: 'hmap',
    name: 'Hypermap (.hmap)',
    what: 'Layers in the format of the original Hypermap',
  },
  { format: 'geojson', name: 'GeoJSON', what: 'Objects, in metres' },
  { format: 'nav2', name: 'Nav2 (YAML + PGM)', what: 'One occupancy grid, for ROS' },
];

/** The formats that the caller may export. */
const formats = computed(() => FORMATS.filter(({ needs }) => may(needs)));
const wantedFormat = signal<ExportFormat>('gpkg');
const format = computed<ExportFormat>(() =>
  formats.value.some((each) => each.format === wantedFormat.value) ? wantedFormat.value : 'hmap',
);
/** The layers that the user has deselected. */
const without = signal<ReadonlySet<string>>(new Set());
const exported = asking<Export>();

const carried = computed(() =>
  (layers.value ?? []).filter((layer) => canCarry(format.value, layer)),
);

/**
 * How many layers the user chooses: one for a format with one layer per file, many for the others.
 * There is no choice for a backup, which always has the whole map, or when only one layer is
 * possible.
 */
const choice = computed(() => {
  if (format.value === 'gpkg' || carried.value.length < 2) return undefined;
  return format.value === 'nav2' ? 'one' : 'many';
});

const only = signal<string>();

function wantedLayers(): string[] {
  const names = carried.value.map(({ name }) => name);
  if (format.value === 'nav2') return [names.find((name) => name === only.value) ?? names[0] ?? ''];
  const wanted = names.filter((name) => !without.value.has(name));
  return format.value === 'gpkg' ? [] : wanted;
}

function save({ file }: Export): void {
  const url = URL.createObjectURL(file.data);
  const link = document.createElement('a');
  link.href = url;
  link.download = file.name;
  link.click();
  // The URL must stay valid until the browser has begun to read it, which no event reports.
  setTimeout(() => URL.revokeObjectURL(url), 60_000);
}

async function run(): Promise<void> {
  const map = mapName.value;
  if (map === undefined) return;
  const wanted = { map, format: format.value, layers: wantedLayers() };
  const got = await exported.ask((signal) => exportFile(wanted, signal));
  if (got) save(got);
}

function Formats() {
  return (
    <fieldset class="plain">
      <legend>Format</legend>
      {formats.value.map(({ format: value, name, what }) => (
        <label key={value} class="format">
          <input
            type="radio"
            name="format"
            checked={format.value === value}
            onChange={() => {
              exported.forget();
              wantedFormat.value = value;
            }}
          />
          <span>
            {name}
            <small>{what}</small>
          </span>
        </label>
      ))}
    </fieldset>
  );
}

function toggle(layer: string): void {
  const next = new Set(without.value);
  if (!next.delete(layer)) next.add(layer);
  without.value = next;
}

function Layers() {
  if (choice.value === undefined) return null;
  const one = choice.value === 'one';
  const wanted = wantedLayers();
  return (
    <fieldset class="plain">
      <legend>{one ? 'Layer' : 'Layers'}</legend>
      {carried.value.map(({ name }) => (
        <label key={name} class="format">
          <input
            type={one ? 'radio' : 'checkbox'}
            name="export-layer"
            checked={wanted.includes(name)}
            onChange={() => (one ? (only.value = name) : toggle(name))}
          />
          <span>{name}</span>
        </label>
      ))}
    </fieldset>
  );
}

function Outcome() {
  const { answer, problem } = exported;
  if (problem.value) {
    return (
      <p class="note bad" role="alert">
        {problem.value}
      </p>
    );
  }
  if (!answer.value) return null;
  const { file, omissions } = answer.value;
  return (
    <div class="note" role="status">
      <p class="plain">
        Saved {file.name}, {sizeText(file.data.size)}.
      </p>
      {omissions.length > 0 && (
        <>
          <p class="plain">The format can't represent everything. Not in the file:</p>
          <ul class="omissions">
            {omissions.map((line) => (
              <li key={line}>{line}</li>
            ))}
          </ul>
        </>
      )}
    </div>
  );
}

function sizeText(bytes: number): string {
  if (bytes < 1024) return `${bytes} B`;
  const kibibytes = bytes / 1024;
  return kibibytes < 1024 ? `${kibibytes.toFixed(1)} KiB` : `${(kibibytes / 1024).toFixed(1)} MiB`;
}

function ExportPanel() {
  const busy = exported.busy.value;
  const nothing = format.value !== 'gpkg' && wantedLayers().filter(Boolean).length === 0;
  return (
    <form
      class="stack"
      onSubmit={(event) => {
        event.preventDefault();
        void run();
      }}
    >
      {asOf.value !== undefined && (
        <p class="note">The current map is saved, not the shown revision.</p>
      )}
      <Formats />
      <Layers />
      {nothing && <p class="note">No layer can be written in this format.</p>}
      <button class="primary" disabled={busy || nothing}>
        {busy ? 'Saving …' : 'Save'}
      </button>
      <Outcome />
    </form>
  );
}

export const exportPanel: Panel = {
  id: 'export',
  title: 'Export',
  icon: ExportIcon,
  component: ExportPanel,
  place: 'right',
  shortcut: 's',
};
