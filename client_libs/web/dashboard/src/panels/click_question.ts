import { effect, untracked } from '@preact/signals';
import { olMap, onMapClick } from '../map/tools';
import { askPoint } from '../state/point';
import { activePanel, openPanel } from './active';

/**
 * Asks what is at the clicked point, for every click that no tool takes, until the returned
 * function is called. The answer is shown in the panel "here", or in the edit panel if that one is
 * open.
 */
export function askOnClick(): () => void {
  return effect(() => {
    if (!olMap.value) return undefined;
    return untracked(() =>
      onMapClick((at, reachM) => {
        if (activePanel.value !== 'edit') openPanel('here');
        void askPoint(at, reachM);
      }),
    );
  });
}
