import { create, ObjectEventKind, ObjectEventSchema, type ObjectEvent } from '@hypermap/client';
import { expect, test } from 'vitest';
import { existenceOver, lastSeen } from './existence';

type Told = Partial<Omit<ObjectEvent, '$typeName' | '$unknown' | 'stamp'>>;

const event = (sequence: number, told: Told) =>
  create(ObjectEventSchema, {
    robot: 'r1',
    sequence: BigInt(sequence),
    stamp: { seconds: BigInt(sequence) },
    ...told,
  });

const { FOUNDED, SEEN, MISSED, MERGED, PINNED } = ObjectEventKind;

test('existence has a point for each observation that changes it', () => {
  const points = existenceOver([
    event(1, { kind: FOUNDED, existence: 0.6, score: 1 }),
    event(2, { kind: SEEN, existence: 0.9, score: 0.5 }),
    event(3, { kind: MISSED, existence: 0.7 }),
    event(4, { kind: PINNED }),
  ]);
  expect(points.map(({ time, existence }) => [time, existence])).toEqual([
    [1000, 0.6],
    [2000, 0.9],
    [3000, 0.7],
  ]);
});

test('the events of a merged duplicate do not lower the existence', () => {
  const points = existenceOver([
    event(1, { kind: FOUNDED, existence: 0.9, score: 1 }),
    event(2, { kind: FOUNDED, existence: 0.4, score: 1, detection: 5 }),
    event(3, { kind: SEEN, existence: 0.95, score: 0.5 }),
    event(3, { kind: MISSED, existence: 0.3 }),
    event(4, { kind: SEEN, existence: 0, score: 0.5 }),
    event(4, { kind: MERGED, track: 'r1/2/5' }),
    event(5, { kind: SEEN, existence: 0.99, score: 0.5 }),
  ]);
  expect(points.map(({ existence }) => existence)).toEqual([0.9, 0.95, 0.99]);
});

test('the last sighting is neither a miss nor a pin', () => {
  const seen = event(2, { kind: SEEN, existence: 0.9, score: 0.5, robot: 'r2' });
  const events = [
    event(1, { kind: FOUNDED, score: 1 }),
    seen,
    event(3, { kind: MISSED }),
    event(4, { kind: PINNED, robot: '' }),
  ];
  expect(lastSeen(events)).toBe(seen);
  expect(lastSeen([])).toBeUndefined();
});
