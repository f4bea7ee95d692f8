// What observations tell of an object's existence.
import { ObjectEventKind, timestampDate, type ObjectEvent } from '@hypermap/client';

const SIGHTINGS = [ObjectEventKind.FOUNDED, ObjectEventKind.SEEN];

/** The newest event in which a robot saw the object. */
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

/** What happened, as a word. */
export function eventWord({ kind }: ObjectEvent): string {
  return KIND_WORDS[kind];
}

/** A probability of existence, and what made it so. */
export interface ExistencePoint {
  event: ObjectEvent;
  /** Milliseconds since 1970. */
  time: number;
  existence: number;
}

/**
 * How the existence went. What became part of the object later has its own events in the list, which
 * do not say whose they are: neither its founding nor its end is one of the object, and of the events
 * of one frame the one counts that is more sure.
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

// A track is called after the detection that founded it. Empty: none was.
function trackFoundedBy(event: ObjectEvent): string {
  return event.kind === ObjectEventKind.FOUNDED ? `${frameOf(event)}/${event.detection}` : '';
}
