import { status, type Status } from '../state/connection';
import { showMap } from '../state/show_map';
import { mapName, maps } from '../state/site';
import './header.css';

const STATUS_WORDS: Record<Status, string> = {
  connecting: 'Connecting',
  live: 'Live',
  disconnected: 'Disconnected',
  error: 'Error',
};

function ConnectionState() {
  return (
    <span class={`connection ${status.value}`} role="status" aria-label="Connection">
      {STATUS_WORDS[status.value]}
    </span>
  );
}

function MapPicker() {
  const all = maps.value ?? [];
  const known = all.some(({ name }) => name === mapName.value);
  return (
    <select
      class="map-picker"
      aria-label="Map"
      value={mapName.value ?? ''}
      onChange={(event) => showMap(event.currentTarget.value)}
    >
      {!known && <option value={mapName.value ?? ''}>{mapName.value ?? 'no map'}</option>}
      {all.map(({ name, problem }) => (
        <option key={name} value={name} disabled={problem !== ''}>
          {problem ? `${name} (can't be opened)` : name}
        </option>
      ))}
    </select>
  );
}

/** The choice of the map, and the status of the connection. */
export function Header({ covers }: { covers?: 'top' }) {
  return (
    <header class="card header" data-covers={covers}>
      <h1 class="unseen">Hypermap</h1>
      <MapPicker />
      <ConnectionState />
    </header>
  );
}
