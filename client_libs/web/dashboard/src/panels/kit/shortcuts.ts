/** A key that works anywhere on the page except in text fields. */
interface Shortcut {
  /** The value of KeyboardEvent.key, with the prefix "mod+" for Control or Command: "mod+z". */
  key: string;
  /** The description in the help. */
  what: string;
  act: () => void;
}

const shortcuts = new Map<string, Shortcut>();

/** Adds a shortcut, replacing one with the same key. The returned function removes it. */
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

/** Starts to handle keys. The returned function stops it. */
export function listenForShortcuts(): () => void {
  const onKey = (event: KeyboardEvent): void => {
    // While a dialog is open, shortcuts are off.
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
