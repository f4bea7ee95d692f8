import {
  EndReason,
  ExplorationState,
  timestampDate,
  type Exploration,
  type Frontier,
  type Goal,
  type Point,
} from '@hypermap/client';
import { useEffect } from 'preact/hooks';
import {
  explorationProblem,
  explorationReport,
  explorations,
  followExploration,
  wantedExploration,
  type ExplorationReport,
} from '../state/exploration';
import { clock, robots, seenWords, type PlacedRobot } from '../state/robots';
import { lookAt } from '../state/selection';
import { asOf } from '../state/time';
import { percent, squareMetres } from '../state/words';
import './exploration_panel.css';
import { ExploreIcon } from './kit/icons';
import type { Panel } from './panel';

/** The distance from a chosen place to the edges of the view, metres. */
const AROUND_M = 3;
const MOST_FRONTIERS = 8;

function lookAround({ x, y }: Pick<Point, 'x' | 'y'>): void {
  lookAt([x - AROUND_M, y - AROUND_M, x + AROUND_M, y + AROUND_M]);
}

function stateOf({ state, endReason }: Exploration): string {
  if (state === ExplorationState.ACTIVE) return 'Under way';
  if (endReason === EndReason.DONE) return 'Done: the whole floor is explored';
  if (endReason === EndReason.STOPPED) return 'Stopped';
  return 'Ended: the rest is unreachable';
}

function areaOfCells(cells: bigint, cellAreaM2: number): string {
  return squareMetres(Number(cells) * cellAreaM2);
}

function Progress({ report: { exploration, progress } }: { report: ExplorationReport }) {
  const { exploredCells, reachableCells, unreachableCells, cellAreaM2, fraction } = progress;
  const rate = progress.rateM2PerS;
  return (
    <section class="stack" aria-label="Progress">
      <p class="row">
        <strong class="exploration-percent number">{percent(fraction)}</strong>
        <span class="soft">{stateOf(exploration)}</span>
      </p>
      <progress aria-label="Explored" max={1} value={fraction} />
      <dl class="facts">
        <dt>Explored</dt>
        <dd>{areaOfCells(exploredCells, cellAreaM2)}</dd>
        <dt>Unexplored</dt>
        <dd>{areaOfCells(reachableCells, cellAreaM2)}</dd>
        <dt>Unreachable</dt>
        <dd>{areaOfCells(unreachableCells, cellAreaM2)}</dd>
        {rate > 0 && (
          <>
            <dt>Rate in the last minute</dt>
            <dd>{rate.toFixed(2)} m²/s</dd>
          </>
        )}
      </dl>
    </section>
  );
}

interface RobotProps {
  name: string;
  /** Undefined while it is not known where the robot is. */
  placed: PlacedRobot | undefined;
  goal: Goal | undefined;
  cellAreaM2: number;
}

/** What is to be known of a robot: that it is offline, else its goal, else what it is doing. */
function robotWords({ placed, goal, cellAreaM2 }: RobotProps): string {
  if (placed && !placed.online) return seenWords(placed, clock.value);
  if (!goal) return placed?.doing || 'no goal';
  const { gainCells, pathLengthM } = goal;
  return `reveals ${areaOfCells(gainCells, cellAreaM2)}, ${pathLengthM.toFixed(1)} m away`;
}

function Robot(props: RobotProps) {
  const { name, placed, goal } = props;
  const until = goal?.expireTime && timestampDate(goal.expireTime).toLocaleTimeString();
  const place = placed ? { x: placed.position[0], y: placed.position[1] } : goal?.position;
  return (
    <li>
      <button
        class="exploration-place"
        title={until && `The goal is reserved for this robot until ${until}`}
        onClick={() => place && lookAround(place)}
      >
        <span class={`mark robot ${placed?.online === false ? 'offline' : ''}`} />
        <span class="grow cut">{name}</span>
        <small class="number">{robotWords(props)}</small>
      </button>
    </li>
  );
}

interface RobotsProps {
  exploration?: Exploration;
  cellAreaM2?: number;
}

/** Lists the robots that have a goal or tell where they are. */
function Robots({ exploration, cellAreaM2 = 0 }: RobotsProps) {
  const isActive = exploration?.state === ExplorationState.ACTIVE;
  const goals = new Map(isActive ? exploration.goals.map((goal) => [goal.robot, goal]) : []);
  const names = [...new Set([...goals.keys(), ...robots.value.keys()])].sort();
  if (!isActive && names.length === 0) return null;
  return (
    <section aria-label="Robots">
      <h3>Robots</h3>
      {isActive && goals.size === 0 && <p class="note">No robot has a goal now.</p>}
      <ul class="choices">
        {names.map((name) => (
          <Robot
            key={name}
            name={name}
            placed={robots.value.get(name)}
            goal={goals.get(name)}
            cellAreaM2={cellAreaM2}
          />
        ))}
      </ul>
    </section>
  );
}

function FrontierRow({ frontier, cellAreaM2 }: { frontier: Frontier; cellAreaM2: number }) {
  const { centroid, viewpoint, gainCells } = frontier;
  return (
    <li>
      <button class="exploration-place" onClick={() => centroid && lookAround(centroid)}>
        <span class="mark frontier" />
        <span class="grow number">
          {centroid?.x.toFixed(1)}, {centroid?.y.toFixed(1)}
        </span>
        <small class="number">
          {viewpoint ? `reveals ${areaOfCells(gainCells, cellAreaM2)}` : 'unreachable'}
        </small>
      </button>
    </li>
  );
}

function Frontiers({ report }: { report: ExplorationReport }) {
  const { frontiers, progress } = report;
  if (frontiers.length === 0) return null;
  const more = frontiers.length - MOST_FRONTIERS;
  return (
    <section aria-label="Frontiers">
      <h3>Frontiers: {frontiers.length}</h3>
      <ul class="choices">
        {frontiers.slice(0, MOST_FRONTIERS).map((frontier, i) => (
          <FrontierRow key={i} frontier={frontier} cellAreaM2={progress.cellAreaM2} />
        ))}
      </ul>
      {more > 0 && <small>and {more} smaller ones</small>}
    </section>
  );
}

function Unreachable({ report }: { report: ExplorationReport }) {
  const places = report.exploration.unreachablePlaces;
  if (places.length === 0) return null;
  return (
    <section aria-label="Unreachable places">
      <h3>Unreachable places</h3>
      <ul class="choices">
        {places.map(({ id, robot, position }) => (
          <li key={`${id}`}>
            <button class="exploration-place" onClick={() => position && lookAround(position)}>
              <span class="mark unreachable" />
              <span class="grow number">
                {position?.x.toFixed(1)}, {position?.y.toFixed(1)}
              </span>
              <small class="cut">{robot}</small>
            </button>
          </li>
        ))}
      </ul>
    </section>
  );
}

function Chooser() {
  if (explorations.value.length < 2) return null;
  return (
    <label class="field">
      Exploration
      <select
        value={`${wantedExploration.value ?? explorations.value[0]?.id}`}
        onChange={(event) => (wantedExploration.value = BigInt(event.currentTarget.value))}
      >
        {explorations.value.map(({ id }) => (
          <option key={`${id}`} value={`${id}`}>
            {`Number ${id}`}
          </option>
        ))}
      </select>
    </label>
  );
}

function ExplorationPanel() {
  useEffect(followExploration, []);
  const report = explorationReport.value;
  if (explorations.value.length === 0) {
    return (
      <div class="stack">
        <p class="note">This map has no exploration.</p>
        <Robots />
      </div>
    );
  }
  return (
    <div class="stack">
      {asOf.value !== undefined && (
        <p class="note">This is the current state, not the state at the shown revision.</p>
      )}
      {explorationProblem.value && (
        <p class="note bad" role="alert">
          {explorationProblem.value}
        </p>
      )}
      <Chooser />
      {report ? (
        <>
          <Progress report={report} />
          <Robots exploration={report.exploration} cellAreaM2={report.progress.cellAreaM2} />
          <Frontiers report={report} />
          <Unreachable report={report} />
        </>
      ) : (
        !explorationProblem.value && <p class="note">Loading …</p>
      )}
    </div>
  );
}

export const explorationPanel: Panel = {
  id: 'exploration',
  title: 'Explore',
  icon: ExploreIcon,
  component: ExplorationPanel,
  place: 'right',
  shortcut: 'x',
};
