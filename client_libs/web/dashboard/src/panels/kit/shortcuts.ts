/** Keys that work wherever one is, but for text fields. */
interface Shortcut {
  /** As KeyboardEvent.key has it; with Control or Command: "mod+z". */
  key: string;
  /** What it does, for the help. */
  what: string;
  act: () => void;
}

const shortcuts = new Map<string, Shortcut>();

export function addShortcut(shortcut: Shortcut): () => void {
  shortcuts.set(shortcut.key, shortcut);
  return () => {
    if (shortcuts.get(shortcut.key) === shortcut) shortcuts.delete(shortcut.key);
  };
}

export function allShortcuts(): Shortcut[] {
  return [...shortcuts.values()];
}

function isTextField(target: EventTarget | null): boolean {
  if (!(target instanceof HTMLElement)) return false;
  if (target instanceof HTMLInputElement)
    return !['checkbox', 'range', 'button'].includes(target.type);
  return target.isContentEditable || ['TEXTAREA', 'SELECT'].includes(target.tagName);
}

export function listenForShortcuts(): () => void {
  const onKey = (event: KeyboardEvent): void => {
    // A dialog has the keyboard for itself.
    if (document.querySelector('dialog[open]')) return;
    if (event.altKey || (isTextField(event.target) && event.key !== 'Escape')) return;
    const mod = event.ctrlKey || event.metaKey;
    const shortcut = shortcuts.get(mod ? `mod+${event.key.toLowerCase()}` : event.key);
    if (!shortcut) return;
    event.preventDefault();
    shortcut.act();
  };
  addEventListener('keydown', onKey);
  return () => removeEventListener('keydown', onKey);
}
