// The page address keeps the shown map, layers, view and revision, so that it can be bookmarked:
// ?map=office&layers=floor,objects~0.5&view=10.2,6,0.05&at=42&of=9182736455463728190
// `of` is the incarnation of the map to which the revision belongs.
import { batch, computed, effect, signal } from '@preact/signals';
import { expectIncarnation, liveIncarnation } from './live';
import { layerViews, layers, mapName, viewOf, type LayerView } from './site';
import { asOf } from './time';

export interface View {
  /** The centre of the whole map element, metres. */
  center: [number, number];
  /** Metres per pixel. */
  resolution: number;
}

/** The view of the map. Undefined until all content is fitted into it. */
export const view = signal<View>();

/** The visible layers that the address names, until the server has listed the layers. */
let wantedLayers: ReadonlyMap<string, number> | undefined;

function parseLayers(text: string): Map<string, number> {
  const entries = text.split(',').filter(Boolean);
  return new Map(
    entries.map((entry) => {
      const [name = '', opacity = '1'] = entry.split('~');
      return [name, Math.min(1, Math.max(0, Number(opacity) || 0))];
    }),
  );
}

function parseView(text: string): View | undefined {
  const [x, y, resolution] = text.split(',').map(Number);
  if (x === undefined || y === undefined || resolution === undefined) return undefined;
  if (![x, y, resolution].every(Number.isFinite) || resolution <= 0) return undefined;
  return { center: [x, y], resolution };
}

function read(): void {
  const params = new URLSearchParams(location.search);
  const map = params.get('map');
  const at = params.get('at');
  const wanted = params.get('layers');
  batch(() => {
    if (map) mapName.value = map;
    if (at && /^\d+$/.test(at)) {
      asOf.value = BigInt(at);
      const of = params.get('of');
      if (of && /^\d+$/.test(of)) expectIncarnation(BigInt(of));
    }
    view.value = parseView(params.get('view') ?? '');
    wantedLayers = wanted === null ? undefined : parseLayers(wanted);
  });
}

function applyWantedLayers(): void {
  if (!wantedLayers || !layers.value) return;
  const views = layers.value.map(({ name }): [string, LayerView] => {
    const opacity = wantedLayers?.get(name);
    return [name, { visible: opacity !== undefined, opacity: opacity ?? 1 }];
  });
  wantedLayers = undefined;
  layerViews.value = new Map(views);
}

function round(value: number, digits: number): string {
  return String(Number(value.toFixed(digits)));
}

const query = computed(() => {
  const params: string[] = [];
  if (mapName.value !== undefined) params.push(`map=${encodeURIComponent(mapName.value)}`);
  if (layers.value && layerViews.value.size > 0) {
    const visible = layers.value.filter((layer) => viewOf(layer).visible);
    const text = visible.map((layer) => {
      const { opacity } = viewOf(layer);
      return opacity === 1 ? layer.name : `${layer.name}~${round(opacity, 2)}`;
    });
    params.push(`layers=${text.join(',')}`);
  }
  if (view.value) {
    const { center, resolution } = view.value;
    params.push(
      `view=${round(center[0], 4)},${round(center[1], 4)},${Number(resolution.toPrecision(6))}`,
    );
  }
  if (asOf.value !== undefined) {
    params.push(`at=${asOf.value}`);
    if (liveIncarnation.value !== 0n) params.push(`of=${liveIncarnation.value}`);
  }
  return params.length > 0 ? `?${params.join('&')}` : '';
});

/** Reads the state from the address, then keeps the address up to date. */
export function startUrl(): void {
  read();
  effect(applyWantedLayers);
  effect(() => {
    const next = query.value;
    // Until the layers are loaded, the address has the visible layers and is not overwritten.
    if (!layers.value && location.search) return;
    window.history.replaceState(null, '', `${location.pathname}${next}`);
  });
}
