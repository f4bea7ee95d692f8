import { fitAll } from '../map/controls';
import { cancelTool, toolHint } from '../map/tools';
import { addShortcut } from '../panels/kit/shortcuts';
import { activePanel } from '../panels/active';
import { NO_HIGHLIGHT, highlight, selectedId } from '../state/selection';
import { helpOpen } from './help';

/** Puts down what is nearest at hand: the tool, the marks on the map, the open panel. */
function escape(): void {
  if (toolHint.value !== undefined) cancelTool();
  else if (selectedId.value !== undefined || highlight.value !== NO_HIGHLIGHT) {
    selectedId.value = undefined;
    highlight.value = NO_HIGHLIGHT;
  } else activePanel.value = undefined;
}

/** The keys of the page itself; panels and tools bring their own. */
export function addPageKeys(): () => void {
  const stops = [
    addShortcut({ key: 'Escape', what: 'Cancel, deselect, close', act: escape }),
    addShortcut({ key: '0', what: 'Show all of the map', act: fitAll }),
    addShortcut({ key: '?', what: 'These keys', act: () => (helpOpen.value = true) }),
  ];
  return () => {
    for (const stop of stops) stop();
  };
}
