import { eventWord, type ExistencePoint } from '../state/existence';
import { percent } from '../state/words';

const WIDTH = 310;
const HEIGHT = 104;
const LEFT = 30;
const RIGHT = 6;
const TOP = 8;
const BOTTOM = 20;

interface Props {
  points: readonly ExistencePoint[];
}

function scales(points: readonly ExistencePoint[]) {
  const from = points[0]?.time ?? 0;
  const span = (points.at(-1)?.time ?? from) - from;
  return {
    x: (time: number) => LEFT + (span > 0 ? (time - from) / span : 0.5) * (WIDTH - LEFT - RIGHT),
    y: (existence: number) => TOP + (1 - existence) * (HEIGHT - TOP - BOTTOM),
  };
}

type Scales = ReturnType<typeof scales>;

/** The path of the line, in steps because existence is constant between observations. */
function steps(points: readonly ExistencePoint[], { x, y }: Scales): string {
  return points
    .map(({ time, existence }, i) =>
      i === 0
        ? `M${x(time).toFixed(1)} ${y(existence).toFixed(1)}`
        : `H${x(time).toFixed(1)}V${y(existence).toFixed(1)}`,
    )
    .join('');
}

function Grid({ y }: Scales) {
  return (
    <>
      {[0, 0.5, 1].map((level) => (
        <g key={level}>
          <line class="grid" x1={LEFT} x2={WIDTH - RIGHT} y1={y(level)} y2={y(level)} />
          <text x={LEFT - 5} y={y(level) + 3} text-anchor="end">
            {100 * level}
          </text>
        </g>
      ))}
    </>
  );
}

function Ends({ points }: { points: readonly ExistencePoint[] }) {
  const [first, last] = [points[0], points.at(-1)];
  const label = (time: number) => new Date(time).toLocaleTimeString();
  return (
    <>
      {first && (
        <text x={LEFT} y={HEIGHT - 5}>
          {label(first.time)}
        </text>
      )}
      {first && last && last.time > first.time && (
        <text x={WIDTH - RIGHT} y={HEIGHT - 5} text-anchor="end">
          {label(last.time)}
        </text>
      )}
    </>
  );
}

/** A chart of an object's existence probability in per cent, with a dot for each observation. */
export function ExistenceChart({ points }: Props) {
  if (points.length === 0) return null;
  const scale = scales(points);
  const last = points.at(-1)?.existence ?? 0;
  return (
    <svg
      class="existence-chart"
      viewBox={`0 0 ${WIDTH} ${HEIGHT}`}
      role="img"
      aria-label={`Existence over time, now ${percent(last)}`}
    >
      <Grid {...scale} />
      <path class="line" d={steps(points, scale)} />
      {points.map(({ event, time, existence }, i) => (
        <circle key={i} class={eventWord(event)} cx={scale.x(time)} cy={scale.y(existence)} r={2.6}>
          <title>{`${eventWord(event)} by ${event.robot}: ${percent(existence)}`}</title>
        </circle>
      ))}
      <Ends points={points} />
    </svg>
  );
}
