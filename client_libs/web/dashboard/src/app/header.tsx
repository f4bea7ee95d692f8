import { Role } from '@hypermap/client';
import { caller } from '../state/caller';
import { status, type Status } from '../state/connection';
import { signing, signOut } from '../state/session';
import { showMap } from '../state/show_map';
import { MapState } from '../state/model';
import { mapName, maps } from '../state/site';
import './header.css';

const STATUS_WORDS: Record<Status, string> = {
  connecting: 'Connecting',
  live: 'Live',
  disconnected: 'Disconnected',
  error: 'Error',
};

const STATE_WORDS: Record<MapState, string> = {
  [MapState.UNSPECIFIED]: '',
  [MapState.SERVING]: '',
  [MapState.DAMAGED]: 'damaged',
  [MapState.READ_ONLY]: 'read-only',
  [MapState.CLOSED]: 'closed',
};

const ROLE_WORDS: Record<Role, string> = {
  [Role.UNSPECIFIED]: '',
  [Role.READER]: 'reader',
  [Role.ROBOT]: 'robot',
  [Role.EDITOR]: 'editor',
  [Role.ADMIN]: 'admin',
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
      {all.map(({ name, state, problem }) => (
        <option key={name} value={name} disabled={state === MapState.CLOSED} title={problem}>
          {problem ? `${name} (${STATE_WORDS[state]})` : name}
        </option>
      ))}
    </select>
  );
}

/** Who is signed in with which role, if the server knows identities. */
function CallerState() {
  if (!caller.value?.hasIdentities) return null;
  const { identity, role } = caller.value;
  const words = `${identity}, ${ROLE_WORDS[role]}`;
  return (
    <div class="caller" role="group" aria-label="Signed in">
      <small class="cut" title={words}>
        {words}
      </small>
      <button class="link" disabled={signing.value} onClick={() => void signOut()}>
        Sign out
      </button>
    </div>
  );
}

/** The choice of the map, the status of the connection, and who is signed in. */
export function Header({ covers }: { covers?: 'top' }) {
  return (
    <header class="card header" data-covers={covers}>
      <h1 class="unseen">Hypermap</h1>
      <MapPicker />
      <ConnectionState />
      <CallerState />
    </header>
  );
}
