import { signal } from '@preact/signals';

/** The id of the open panel beside the map. Undefined: none. */
export const activePanel = signal<string>();

export function openPanel(id: string): void {
  activePanel.value = id;
}

export function togglePanel(id: string): void {
  activePanel.value = activePanel.value === id ? undefined : id;
}
