import { signal } from '@preact/signals';

/** The id of the open panel. Undefined if none is open. */
export const activePanel = signal<string>();

export function openPanel(id: string): void {
  activePanel.value = id;
}

export function togglePanel(id: string): void {
  activePanel.value = activePanel.value === id ? undefined : id;
}
