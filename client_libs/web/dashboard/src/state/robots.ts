// Where the robots of the shown map are.
import { timestampDate, watchRobots, type RobotPresence, type RobotsState } from '@hypermap/client';
import { computed, effect, signal, untracked } from '@preact/signals';
import { client, signInWanted } from './connection';
import { liveIncarnation } from './live';
import type { Position } from './model';
import { mapName } from './site';
import { ago } from './words';

/** A robot whose pose is known in the map's own frame. */
export interface PlacedRobot {
  name: string;
  position: Position;
  /** Radians, counter-clockwise from the x axis. */
  yaw: number;
  online: boolean;
  /** What the robot is doing, in its own words. Empty if it does not tell. */
  doing: string;
  /** The time at which the robot was seen last, by the clock of this page. */
  seen: Date;
}

/** What the server told last, and when. */
const told = signal<{ state: RobotsState; at: Date }>();

/** The robots of the shown map that can be drawn, by name. */
export const robots = computed<ReadonlyMap<string, PlacedRobot>>(() => {
  const placed = new Map<string, PlacedRobot>();
  if (!told.value) return placed;
  const { state, at } = told.value;
  for (const [name, robot] of state.robots) {
    const found = place(name, robot, at.getTime() - state.time.getTime());
    if (found) placed.set(name, found);
  }
  return placed;
});

/** `aheadMs` is what the clock of this page is ahead of the server's. */
function place(
  name: string,
  { report, inMapFrame, online, seenTime }: RobotPresence,
  aheadMs: number,
): PlacedRobot | undefined {
  if (!inMapFrame || !report?.pose || !seenTime) return undefined;
  const { x, y, yaw } = report.pose;
  const seen = new Date(timestampDate(seenTime).getTime() + aheadMs);
  return { name, position: [x, y], yaw, online, doing: report.state, seen };
}

/** The interval at which the ages of positions are written anew. */
const TICK_MS = 1000;
/** The time by the clock of this page, each second. */
export const clock = signal(new Date());

/**
 * The age of a robot's position: "2 s ago" or, of one that is offline, "offline, last seen 5 min
 * ago".
 */
export function seenWords({ online, seen }: PlacedRobot, now: Date): string {
  const seconds = Math.max(0, Math.floor((now.getTime() - seen.getTime()) / 1000));
  const age = seconds < 60 ? `${seconds} s ago` : ago(seen, now);
  return online ? age : `offline, last seen ${age}`;
}

async function follow(map: string, signal: AbortSignal): Promise<void> {
  try {
    for await (const state of watchRobots(client.value, map, { signal })) {
      told.value = { state, at: new Date() };
    }
  } catch {
    // The watch of the map tells the user of this error, too, and of the end of it.
  }
}

const visible = signal(true);

/**
 * Starts to follow the robots of the shown map. A page that nobody sees gives the connection back,
 * because browsers allow few to a server.
 */
export function startRobots(): void {
  const look = (): void => void (visible.value = !document.hidden);
  look();
  document.addEventListener('visibilitychange', look);
  setInterval(() => (clock.value = new Date()), TICK_MS);
  effect(() => {
    mapName.value;
    liveIncarnation.value;
    untracked(() => (told.value = undefined));
  });
  effect(() => {
    const map = mapName.value;
    client.value;
    // A map that has come back under its name is another one.
    if (map === undefined || !visible.value || !liveIncarnation.value || signInWanted.value) return;
    const ended = new AbortController();
    untracked(() => void follow(map, ended.signal));
    return () => ended.abort();
  });
}
