import type { ComponentType } from 'preact';
import type { RestrictedRpc } from '../state/caller';

/** A panel beside the map. */
export interface Panel {
  /** A unique name in lower case. */
  id: string;
  title: string;
  icon: ComponentType;
  component: ComponentType;
  /**
   * On wide screens, panels at `left` and `bottom` are always visible, and one at `right` is open.
   */
  place: 'left' | 'right' | 'bottom';
  /** The key that opens the panel. */
  shortcut: string;
  /** The rpc without which the panel is of no use. */
  needs?: RestrictedRpc;
}
