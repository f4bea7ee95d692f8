import { computed } from '@preact/signals';
import { may } from '../state/caller';
import { alignPanel } from './align_panel';
import { changesPanel } from './changes_panel';
import { editPanel } from './edit_panel';
import { explorationPanel } from './exploration_panel';
import { exportPanel } from './export_panel';
import { herePanel } from './here_panel';
import { layersPanel } from './layers_panel';
import type { Panel } from './panel';
import { searchPanel } from './search_panel';
import { timePanel } from './time_panel';

const ALL: readonly Panel[] = [
  layersPanel,
  searchPanel,
  herePanel,
  editPanel,
  changesPanel,
  explorationPanel,
  alignPanel,
  exportPanel,
  timePanel,
];

/** The panels that are of use to the caller, in the order of their tabs. */
export const panels = computed(() => ALL.filter(({ needs }) => may(needs)));
