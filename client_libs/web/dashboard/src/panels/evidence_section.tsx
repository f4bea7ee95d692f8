import { ObjectEventKind, timestampDate, type ObjectEvent } from '@hypermap/client';
import { evidence } from '../state/evidence';
import { eventWord, existenceOver, lastSeen } from '../state/existence';
import { asOf } from '../state/time';
import { count, percent } from '../state/words';
import { ExistenceChart } from './existence_chart';

const LISTED = 50;

function whenOf({ stamp }: ObjectEvent): string {
  return stamp ? timestampDate(stamp).toLocaleString() : '';
}

function EventRow({ event }: { event: ObjectEvent }) {
  const word = eventWord(event);
  const { robot, existence } = event;
  return (
    <li title={whenOf(event)}>
      <span class={word}>{word}</span>
      <span class="cut">
        {robot}{' '}
        <span class="soft">{event.stamp && timestampDate(event.stamp).toLocaleTimeString()}</span>
      </span>
      <span class="number">{existence === undefined ? '' : percent(existence)}</span>
    </li>
  );
}

function LastSeen({ events }: { events: readonly ObjectEvent[] }) {
  const seen = lastSeen(events);
  if (!seen) return <p class="note">No robot has seen it.</p>;
  return (
    <p>
      Last seen by <strong>{seen.robot}</strong>, {whenOf(seen)}
    </p>
  );
}

function countOf(events: readonly ObjectEvent[], ...kinds: ObjectEventKind[]): number {
  return events.filter(({ kind }) => kinds.includes(kind)).length;
}

/** The observations that an object was fused from, and its existence over time. */
export function EvidenceSection({ objectId }: { objectId: bigint }) {
  const known = evidence.answer.value;
  if (evidence.problem.value) return <p class="note bad">{evidence.problem.value}</p>;
  if (known?.objectId !== objectId) return <p class="note">Loading evidence …</p>;
  if (!known.explanation) {
    return <p class="note">This object was not fused from observations: it was added by hand.</p>;
  }
  const { events, strategy } = known.explanation;
  const seen = countOf(events, ObjectEventKind.FOUNDED, ObjectEventKind.SEEN);
  const missed = countOf(events, ObjectEventKind.MISSED);
  return (
    <section class="evidence" aria-label="Evidence">
      <h3>Evidence over time{asOf.value !== undefined && ', as of now'}</h3>
      <ExistenceChart points={existenceOver(events)} />
      <LastSeen events={events} />
      <details>
        <summary>
          Seen {count(seen, 'time', 'times')}, missed {missed}, fused by “{strategy}”
        </summary>
        <ol class="event-list" aria-label="Observations">
          {events
            .slice(-LISTED)
            .reverse()
            .map((event, i) => (
              <EventRow key={i} event={event} />
            ))}
        </ol>
        {events.length > LISTED && <small>and {events.length - LISTED} earlier ones</small>}
      </details>
    </section>
  );
}
