import type { ComponentType } from 'preact';

/** A part of the page beside the map. */
export interface Panel {
  /** Unique, in lower case. */
  id: string;
  title: string;
  icon: ComponentType;
  component: ComponentType;
  /** On wide screens: `left` and `bottom` are always there, of those at `right` one is open. */
  place: 'left' | 'right' | 'bottom';
  /** Opens it. */
  shortcut: string;
}
