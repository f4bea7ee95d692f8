import { signal } from '@preact/signals';
import { useEffect, useRef } from 'preact/hooks';
import { drawPolygon } from '../map/tools';
import { ask, find, forgetAnswer } from '../state/find';
import { searchableValues } from '../state/layer_content';
import { knownLabels } from '../state/objects';
import { layers } from '../state/site';
import { view } from '../state/url';
import { AnswerList } from './answer_list';
import './search_panel.css';
import { SearchIcon } from './kit/icons';
import type { Panel } from './panel';

type Where = 'everywhere' | 'area' | 'nearest';

const PLACES: readonly { where: Where; name: string; title: string }[] = [
  { where: 'everywhere', name: 'Everywhere', title: 'On the whole map' },
  { where: 'area', name: 'In an area', title: 'In a polygon that you draw' },
  { where: 'nearest', name: 'Nearest', title: 'Nearest to the centre of the map' },
];

const value = signal('');
const where = signal<Where>('everywhere');

/**
 * The values that can be searched on this map: labels, their aliases, and words for cell values.
 */
function suggestions(): string[] {
  const aliases = layers.value?.flatMap((layer) => layer.aliases.map(({ alias }) => alias)) ?? [];
  const words = layers.value?.flatMap(searchableValues) ?? [];
  return [...new Set([...knownLabels.value, ...aliases, ...words])];
}

async function submit(): Promise<void> {
  const wanted = value.value.trim();
  if (where.value === 'area') {
    const what = wanted || 'everything';
    const ring = await drawPolygon(
      `Draw the area to search for ${what}: click its corners; click the last one twice`,
    );
    if (!ring) return;
    await ask(wanted ? { kind: 'value', value: wanted, ring } : { kind: 'area', ring });
  } else if (where.value === 'nearest' && view.value) {
    await ask({ kind: 'nearest', value: wanted, from: view.value.center });
  } else {
    await ask({ kind: 'value', value: wanted });
  }
}

function PlaceChoice() {
  return (
    <div class="segments" role="group" aria-label="Where to look">
      {PLACES.map((place) => (
        <button
          key={place.where}
          type="button"
          aria-pressed={where.value === place.where}
          title={place.title}
          onClick={() => (where.value = place.where)}
        >
          {place.name}
        </button>
      ))}
    </div>
  );
}

function Form() {
  const input = useRef<HTMLInputElement>(null);
  useEffect(() => {
    // On touch screens the focus would open the on-screen keyboard.
    if (matchMedia('(pointer: fine)').matches) input.current?.focus();
  }, []);
  const inArea = where.value === 'area';
  return (
    <form
      class="stack search-form"
      role="search"
      onSubmit={(event) => {
        event.preventDefault();
        void submit();
      }}
    >
      <div class="row">
        <input
          ref={input}
          type="search"
          aria-label="What to find"
          placeholder={inArea ? 'everything' : 'chair, unexplored, >0.65, tag:red'}
          list="known-values"
          autocomplete="off"
          required={!inArea}
          value={value.value}
          onInput={(event) => (value.value = event.currentTarget.value)}
        />
        <button class="primary">{inArea ? 'Draw' : 'Find'}</button>
      </div>
      <PlaceChoice />
      <datalist id="known-values">
        {suggestions().map((word) => (
          <option key={word} value={word} />
        ))}
      </datalist>
    </form>
  );
}

function Search() {
  const { answer, busy, problem } = find;
  return (
    <div class="stack">
      <Form />
      {problem.value && (
        <p class="note bad" role="alert">
          {problem.value}
        </p>
      )}
      {busy.value && !answer.value && <p class="note">Searching …</p>}
      {answer.value && <AnswerList answer={answer.value} onClear={forgetAnswer} />}
    </div>
  );
}

export const searchPanel: Panel = {
  id: 'search',
  title: 'Search',
  icon: SearchIcon,
  component: Search,
  place: 'right',
  shortcut: '/',
};
