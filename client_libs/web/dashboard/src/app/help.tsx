import { signal } from '@preact/signals';
import { useEffect, useRef } from 'preact/hooks';
import { CloseIcon } from '../panels/kit/icons';
import { allShortcuts } from '../panels/kit/shortcuts';
import './help.css';

export const helpOpen = signal(false);

/** Keys that OpenLayers and the map handle while the map has the focus. */
const MAP_KEYS: readonly [key: string, what: string][] = [
  ['Arrows', 'Move the map'],
  ['+  −', 'Zoom'],
  ['Enter', 'Query the centre of the map'],
];

function words(key: string): string {
  return key
    .replace(/^mod\+/, 'Ctrl+')
    .replace(/\+(\w)$/, (_, last: string) => `+${last.toUpperCase()}`);
}

/** The list of all keyboard shortcuts. */
export function Help() {
  const dialog = useRef<HTMLDialogElement>(null);
  useEffect(() => {
    if (helpOpen.value) dialog.current?.showModal();
  }, [helpOpen.value]);
  if (!helpOpen.value) return null;
  const close = () => (helpOpen.value = false);
  const keys = [...allShortcuts().map(({ key, what }) => [key, what] as const), ...MAP_KEYS];
  return (
    <dialog ref={dialog} class="card help" aria-label="Keys" onClose={close}>
      <header class="row">
        <h2 class="grow">Keys</h2>
        <button class="bare" aria-label="Close" onClick={close}>
          <CloseIcon />
        </button>
      </header>
      <dl>
        {keys.map(([key, what]) => (
          <div key={key} class="row">
            <dt>
              <kbd>{words(key)}</kbd>
            </dt>
            <dd>{what}</dd>
          </div>
        ))}
      </dl>
    </dialog>
  );
}
