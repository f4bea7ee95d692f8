import { effect, untracked } from '@preact/signals';
import { askPoint } from '../state/point';
import { activePanel, openPanel } from '../panels/active';
import { olMap, onMapClick } from './tools';

/** A click that no tool takes asks what is there. Who edits goes on editing what was clicked. */
export function askOnClick(): () => void {
  return effect(() => {
    if (!olMap.value) return undefined;
    return untracked(() =>
      onMapClick((at) => {
        if (activePanel.value !== 'edit') openPanel('here');
        void askPoint(at);
      }),
    );
  });
}
