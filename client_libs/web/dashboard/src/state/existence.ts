// The existence probability of an object over time, derived from its observation events.
import { ObjectEventKind, timestampDate, type ObjectEvent } from '@hypermap/client';

const SIGHTINGS = [ObjectEventKind.FOUNDED, ObjectEventKind.SEEN];

/** Returns the newest event in which a robot saw the object. */
export function lastSeen(events: readonly ObjectEvent[]): ObjectEvent | undefined {
  return events.findLast(({ kind }) => SIGHTINGS.includes(kind));
}

const KIND_WORDS: Record<ObjectEventKind, string> = {
  [ObjectEventKind.UNSPECIFIED]: '',
  [ObjectEventKind.FOUNDED]: 'founded',
  [ObjectEventKind.SEEN]: 'seen',
  [ObjectEventKind.MISSED]: 'missed',
  [ObjectEventKind.MERGED]: 'merged',
  [ObjectEventKind.PINNED]: 'pinned',
  [ObjectEventKind.REMOVED]: 'removed',
};

/** The kind of an event as a word. */
export function eventWord({ kind }: ObjectEvent): string {
  return KIND_WORDS[kind];
}

/** A probability of existence and the event that led to it. */
export interface ExistencePoint {
  event: ObjectEvent;
  /** Milliseconds since 1970. */
  time: number;
  existence: number;
}

/**
 * Returns the existence of an object after each frame. The list also has the events of duplicates
 * that were merged into the object later, and those events do not name their track. Therefore the
 * founding of a duplicate and its end at the merge are left out, and of several events of one frame
 * the one with the highest existence counts.
 */
export function existenceOver(events: readonly ObjectEvent[]): ExistencePoint[] {
  const merged = events.filter(({ kind }) => kind === ObjectEventKind.MERGED);
  const tracks = new Set(merged.map(({ track }) => track));
  const merges = new Set(merged.map(frameOf));
  const byFrame = new Map<string, ExistencePoint>();
  for (const event of events) {
    const { stamp, existence } = event;
    if (!stamp || existence === undefined || tracks.has(trackFoundedBy(event))) continue;
    const frame = frameOf(event);
    if (existence === 0 && merges.has(frame)) continue;
    const known = byFrame.get(frame);
    if (known && known.existence > existence) continue;
    byFrame.set(frame, { event, time: timestampDate(stamp).getTime(), existence });
  }
  return [...byFrame.values()];
}

function frameOf({ robot, sequence }: ObjectEvent): string {
  return `${robot}/${sequence}`;
}

// A track is named after the detection that founded it. Returns "" for events of other kinds.
function trackFoundedBy(event: ObjectEvent): string {
  return event.kind === ObjectEventKind.FOUNDED ? `${frameOf(event)}/${event.detection}` : '';
}
