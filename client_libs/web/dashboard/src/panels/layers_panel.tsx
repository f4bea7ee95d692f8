import { signal } from '@preact/signals';
import { BOTTOM_TO_TOP, contentOf, groupTitle } from '../state/layer_content';
import type { Layer } from '../state/model';
import { layers, setView, viewOf } from '../state/site';
import { asOf, shown } from '../state/time';
import { ChevronIcon, LayersIcon } from './kit/icons';
import './layers_panel.css';
import { Legend } from './legend';
import type { Panel } from './panel';

/** The layers by the titles of their groups, from top to bottom. */
function groupsOf(all: readonly Layer[]): Map<string, Layer[]> {
  const groups = new Map<string, Layer[]>();
  for (const content of BOTTOM_TO_TOP.toReversed()) {
    for (const layer of all.filter((other) => contentOf(other) === content)) {
      const title = groupTitle(layer);
      groups.set(title, [...(groups.get(title) ?? []), layer]);
    }
  }
  return groups;
}

/** The layers whose details are expanded. */
const open = signal<ReadonlySet<string>>(new Set());

function toggle(name: string): void {
  const next = new Set(open.value);
  if (!next.delete(name)) next.add(name);
  open.value = next;
}

/** The extent of a layer's content: the number of objects, or the size of a cell. */
function extentOf(layer: Layer): string {
  const store = shown.value.stores.value.get(layer.name);
  if (!store) return asOf.value === undefined ? 'empty' : 'no content';
  store.version.value; // Rendered again after each change.
  if (store.type === 'objects') return store.objects.size.toLocaleString();
  if (!store.geometry) return 'empty';
  const centimetres = store.geometry.resolutionM * 100;
  return `${centimetres.toLocaleString(undefined, { maximumFractionDigits: 1 })} cm`;
}

function Opacity({ layer }: { layer: Layer }) {
  const { opacity } = viewOf(layer);
  return (
    <label class="row opacity">
      <span class="soft">Opacity</span>
      <input
        class="grow"
        type="range"
        min="0"
        max="1"
        step="0.05"
        value={opacity}
        aria-label={`Opacity of ${layer.name}`}
        onInput={(event) => setView(layer, { opacity: Number(event.currentTarget.value) })}
      />
      <span class="soft number">{Math.round(opacity * 100)} %</span>
    </label>
  );
}

function LayerRow({ layer }: { layer: Layer }) {
  const isOpen = open.value.has(layer.name);
  const details = `layer-${layer.name}`;
  return (
    <li class="layer">
      <div class="row">
        <label class="row grow">
          <input
            type="checkbox"
            checked={viewOf(layer).visible}
            onChange={(event) => setView(layer, { visible: event.currentTarget.checked })}
          />
          <span class="grow cut" title={layer.name}>
            {layer.name}
          </span>
        </label>
        <span class="soft number">{extentOf(layer)}</span>
        <button
          class="bare"
          aria-label={`Details of ${layer.name}`}
          aria-expanded={isOpen}
          aria-controls={details}
          onClick={() => toggle(layer.name)}
        >
          <ChevronIcon />
        </button>
      </div>
      {isOpen && (
        <div id={details} class="layer-details">
          <Opacity layer={layer} />
          <Legend layer={layer} />
        </div>
      )}
    </li>
  );
}

function Layers() {
  const all = layers.value;
  if (!all) return <p class="soft">No map is open.</p>;
  if (all.length === 0) return <p class="soft">This map has no layers.</p>;
  return (
    <div class="stack">
      {Array.from(groupsOf(all), ([title, group]) => (
        <section key={title}>
          <h3>{title}</h3>
          <ul>
            {group.map((layer) => (
              <LayerRow key={layer.name} layer={layer} />
            ))}
          </ul>
        </section>
      ))}
    </div>
  );
}

export const layersPanel: Panel = {
  id: 'layers',
  title: 'Layers',
  icon: LayersIcon,
  component: Layers,
  place: 'left',
  shortcut: 'l',
};
