// The maps of the server, the shown map, and the visibility of its layers.
import { computed, signal } from '@preact/signals';
import { client, noteAlive, noteFailure } from './connection';
import { BOTTOM_TO_TOP, contentOf } from './layer_content';
import { MapState, type Layer } from './model';

export interface MapEntry {
  name: string;
  /** The map's own frame. */
  frameId: string;
  state: MapState;
  /** The reason why the state is not SERVING. */
  problem: string;
  /** Tells this map from an earlier or later one of the same name. 0 if it can't be opened. */
  incarnation: bigint;
}

/** Undefined until the server has answered. */
export const maps = signal<readonly MapEntry[]>();
export const mapName = signal<string>();
/** The shown map's own frame, which all coordinates are in. Undefined until the server answers. */
export const mapFrame = computed(
  () => maps.value?.find(({ name }) => name === mapName.value)?.frameId,
);
/** The layers of the shown map from bottom to top. Undefined until the server has answered. */
export const layers = signal<readonly Layer[]>();

export interface LayerView {
  visible: boolean;
  /** In [0, 1]. */
  opacity: number;
}

/** The views that the user changed, by layer; all other layers have their `defaultView`. */
export const layerViews = signal<ReadonlyMap<string, LayerView>>(new Map());

export function defaultView(layer: Layer): LayerView {
  const content = contentOf(layer);
  // Measurements cover the layers below them, so they are hidden at first.
  if (content === 'measurements') return { visible: false, opacity: 0.6 };
  return { visible: true, opacity: content === 'binary' ? 0.6 : 1 };
}

export function viewOf(layer: Layer): LayerView {
  return layerViews.value.get(layer.name) ?? defaultView(layer);
}

export function setView(layer: Layer, change: Partial<LayerView>): void {
  const view = { ...viewOf(layer), ...change };
  layerViews.value = new Map(layerViews.value).set(layer.name, view);
}

export const visibleLayers = computed(() => (layers.value ?? []).filter((l) => viewOf(l).visible));

export function layerNamed(name: string): Layer | undefined {
  return layers.value?.find((layer) => layer.name === name);
}

/** Loads the list of maps. If no map is shown yet, shows the first one that can be opened. */
export async function loadMaps(): Promise<void> {
  try {
    const answer = await client.value.catalog.listMaps({});
    maps.value = answer.maps.map(({ name, frameId, state, problem, incarnation }) => ({
      name,
      frameId,
      // Older servers tell a problem of closed maps only.
      state: state || (problem ? MapState.CLOSED : MapState.SERVING),
      problem,
      incarnation,
    }));
    if (mapName.value !== undefined) return;
    const first = maps.value.find(({ state }) => state !== MapState.CLOSED);
    if (first) mapName.value = first.name;
    else noteAlive();
  } catch (error) {
    // While a map is shown, its watch reports the connection's status.
    if (mapName.value === undefined) noteFailure(error);
  }
}

/** Loads the layers of a map. */
export async function loadLayers(map: string): Promise<void> {
  const answer = await client.value.catalog.listLayers({ map });
  if (map !== mapName.value) return;
  layers.value = answer.layers.toSorted(
    (a, b) => heightOf(a) - heightOf(b) || a.name.localeCompare(b.name),
  );
}

function heightOf(layer: Layer): number {
  return BOTTOM_TO_TOP.indexOf(contentOf(layer));
}
