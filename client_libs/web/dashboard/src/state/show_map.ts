import { batch, effect, signal, untracked } from '@preact/signals';
import { replacements } from './live';
import { NO_HIGHLIGHT, highlight, selectedId } from './selection';
import { layerViews, layers, mapName } from './site';
import { asOf } from './time';
import { view } from './url';

/** The shown or wanted revision that was left, because another map has replaced the one it is of. */
export const leftRevision = signal<bigint>();

/** Shows all of another map, live and with the default visibility of its layers. */
export function showMap(name: string): void {
  if (mapName.value === name) return;
  batch(() => {
    layers.value = undefined;
    layerViews.value = new Map();
    asOf.value = undefined;
    leftRevision.value = undefined;
    view.value = undefined;
    selectedId.value = undefined;
    highlight.value = NO_HIGHLIGHT;
    mapName.value = name;
  });
}

/** Leaves the earlier revision and the selection whenever another map has replaced the shown one. */
export function startShowing(): void {
  effect(() => {
    if (replacements.value === 0) return;
    untracked(() => {
      batch(() => {
        leftRevision.value = asOf.value;
        asOf.value = undefined;
        selectedId.value = undefined;
        highlight.value = NO_HIGHLIGHT;
      });
    });
  });
}
