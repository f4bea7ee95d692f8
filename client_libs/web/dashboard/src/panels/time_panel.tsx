import { signal } from '@preact/signals';
import { useEffect } from 'preact/hooks';
import { liveRevision } from '../state/live';
import {
  asOf,
  asOfCommit,
  asOfLoading,
  backToLive,
  loadOldest,
  oldest,
  showRevision,
  showTime,
} from '../state/time';
import { formatTime } from './kit/format';
import { BackIcon, ForwardIcon, TimeIcon } from './kit/icons';
import { addShortcut } from './kit/shortcuts';
import type { Panel } from './panel';
import './time_panel.css';

const shownRevision = () => asOf.value ?? liveRevision.value;

function step(by: bigint): void {
  const revision = shownRevision() + by;
  if (revision >= oldest.value && revision <= liveRevision.value) showRevision(revision);
}

function Slider() {
  return (
    <input
      class="grow"
      type="range"
      min={Number(oldest.value)}
      max={Number(liveRevision.value)}
      value={Number(shownRevision())}
      disabled={liveRevision.value <= oldest.value}
      aria-label="Revision"
      aria-valuetext={asOf.value === undefined ? 'live' : `revision ${asOf.value}`}
      onPointerDown={() => void loadOldest()}
      onInput={(event) => showRevision(BigInt(event.currentTarget.value))}
    />
  );
}

const timeFieldOpen = signal(false);

function TimeField() {
  return (
    <form
      class="row"
      onSubmit={(event) => {
        event.preventDefault();
        const text = new FormData(event.currentTarget).get('time');
        if (text) void showTime(new Date(String(text)));
      }}
    >
      <input type="datetime-local" step="1" name="time" aria-label="Date and time" required />
      <button>Go</button>
    </form>
  );
}

function RevisionText() {
  if (asOf.value === undefined) {
    return <span class="soft number">revision {String(liveRevision.value)}</span>;
  }
  const { time, author } = asOfCommit.value ?? {};
  return (
    <span class={`soft number cut ${asOfLoading.value ? 'waits' : ''}`} title={author}>
      revision {String(asOf.value)}
      {time && `, ${formatTime(time)}`}
    </span>
  );
}

function Time() {
  useEffect(() => {
    const stops = [
      addShortcut({ key: '[', what: 'One revision back', act: () => step(-1n) }),
      addShortcut({ key: ']', what: 'One revision on', act: () => step(1n) }),
    ];
    return () => {
      for (const stop of stops) stop();
    };
  }, []);
  const isPast = asOf.value !== undefined;
  return (
    <div class={`time ${isPast ? 'past' : ''}`}>
      <div class="row">
        <button
          class="bare"
          aria-label="One revision back"
          disabled={shownRevision() <= oldest.value}
          onClick={() => step(-1n)}
        >
          <BackIcon />
        </button>
        <Slider />
        <button
          class="bare"
          aria-label="One revision on"
          disabled={!isPast}
          onClick={() => step(1n)}
        >
          <ForwardIcon />
        </button>
        <button class="live" aria-pressed={!isPast} onClick={backToLive}>
          Live
        </button>
        <button
          class="bare"
          aria-label="Go to a time"
          aria-expanded={timeFieldOpen.value}
          onClick={() => (timeFieldOpen.value = !timeFieldOpen.value)}
        >
          <TimeIcon />
        </button>
      </div>
      <div class="row time-words">
        <span class="grow cut">
          <RevisionText />
        </span>
        {timeFieldOpen.value && <TimeField />}
      </div>
    </div>
  );
}

export const timePanel: Panel = {
  id: 'time',
  title: 'Time',
  icon: TimeIcon,
  component: Time,
  place: 'bottom',
  shortcut: 't',
};
