import { fitAll } from '../map/controls';
import { cancelTool, toolHint } from '../map/tools';
import { addShortcut } from '../panels/kit/shortcuts';
import { activePanel } from '../panels/active';
import { NO_HIGHLIGHT, highlight, selectedId } from '../state/selection';
import { helpOpen } from './help';

/** Ends the active tool; otherwise clears the marks on the map; otherwise closes the open panel. */
function escape(): void {
  if (toolHint.value !== undefined) cancelTool();
  else if (selectedId.value !== undefined || highlight.value !== NO_HIGHLIGHT) {
    selectedId.value = undefined;
    highlight.value = NO_HIGHLIGHT;
  } else activePanel.value = undefined;
}

/** Adds the shortcuts of the page itself. Panels and tools add their own. */
export function addPageKeys(): () => void {
  const stops = [
    addShortcut({ key: 'Escape', what: 'Cancel, deselect, close', act: escape }),
    addShortcut({ key: '0', what: 'Show the whole map', act: fitAll }),
    addShortcut({ key: '?', what: 'Show this help', act: () => (helpOpen.value = true) }),
  ];
  return () => {
    for (const stop of stops) stop();
  };
}
