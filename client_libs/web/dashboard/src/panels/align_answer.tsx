import { TransformAmbiguity } from '@hypermap/client';
import {
  applied,
  applyAllTheSame,
  applyEstimate,
  applyObstacle,
  childFrameOf,
  deviationsOf,
  estimate,
  isAmbiguous,
  type Estimate,
} from '../state/align';
import type { Pose2 } from '../state/rigid';
import { degrees, percent } from '../state/words';

const AMBIGUITY_WORDS: Record<TransformAmbiguity, string> = {
  [TransformAmbiguity.UNSPECIFIED]: '',
  [TransformAmbiguity.NONE]: '',
  [TransformAmbiguity.LITTLE_AGREEMENT]: 'too little agrees, or too much contradicts',
  [TransformAmbiguity.RUNNER_UP]: 'the runner-up is about as good',
  [TransformAmbiguity.FREE_DIRECTION]: 'nothing holds the transform in some direction',
};

interface RowProps {
  title: string;
  pose: Pose2;
  score?: number | undefined;
}

function PoseRow({ title, pose: { x, y, yaw }, score }: RowProps) {
  return (
    <tr>
      <th scope="row">{title}</th>
      <td>{x.toFixed(3)}</td>
      <td>{y.toFixed(3)}</td>
      <td>{degrees(yaw)}</td>
      <td>{score?.toFixed(2)}</td>
    </tr>
  );
}

function Poses({ answer }: { answer: Estimate }) {
  const { best, score, response } = answer;
  const deviations = deviationsOf(answer);
  const runnerUp = response.runnerUp;
  return (
    <table class="align-poses number" aria-label="Transform">
      <thead>
        <tr>
          <td />
          <th scope="col">x, m</th>
          <th scope="col">y, m</th>
          <th scope="col">yaw</th>
          <th scope="col">score</th>
        </tr>
      </thead>
      <tbody>
        <PoseRow title="Best" pose={best} score={score} />
        {deviations && <PoseRow title="Std. dev." pose={deviations} />}
        {runnerUp?.targetFromSource && (
          <PoseRow title="Runner-up" pose={runnerUp.targetFromSource} score={runnerUp.score} />
        )}
      </tbody>
    </table>
  );
}

/** What was read of a side: "attic/floor, revision 3". */
function sideWords({ map, layer, revision }: Estimate['source']): string {
  return `${layer ? `${map}/${layer}` : map}, revision ${revision}`;
}

function Trust({ answer }: { answer: Estimate }) {
  const { ambiguity, inlierShare } = answer.response;
  return (
    <>
      <p class="align-words">
        {percent(inlierShare)} of what can be compared agrees.{' '}
        <small>
          {sideWords(answer.source)}, over {sideWords(answer.target)}
        </small>
      </p>
      {isAmbiguous(answer) ? (
        <p class="note warn" role="status">
          Ambiguous: {AMBIGUITY_WORDS[ambiguity] || 'the server does not tell why'}.
        </p>
      ) : (
        <p class="note" role="status">
          Not ambiguous.
        </p>
      )}
    </>
  );
}

function Apply({ answer }: { answer: Estimate }) {
  const done = applied.answer.value;
  const obstacle = applyObstacle.value;
  if (obstacle === 'role') {
    return <p class="note">Your role does not allow to apply the transform.</p>;
  }
  return (
    <section class="stack" aria-label="Apply">
      <p class="align-words">
        <small>
          Sets the frame {childFrameOf(answer)} of {answer.target.map}: its layers in this frame
          then lie where {answer.source.map} lies.
        </small>
      </p>
      {isAmbiguous(answer) && (
        <label class="row">
          <input
            type="checkbox"
            checked={applyAllTheSame.value}
            onChange={(event) => (applyAllTheSame.value = event.currentTarget.checked)}
          />
          Apply all the same
        </label>
      )}
      <button
        disabled={obstacle !== undefined || applied.busy.value || done !== undefined}
        onClick={() => void applyEstimate()}
      >
        {applied.busy.value ? 'Applying …' : 'Apply'}
      </button>
      {applied.problem.value && (
        <p class="note bad" role="alert">
          {applied.problem.value}
        </p>
      )}
      {done && (
        <p class="note" role="status">
          Frame {done.childFrameId} is set in {done.parentFrameId}, revision {String(done.revision)}
          .
        </p>
      )}
    </section>
  );
}

/** The last estimate: how far it can be trusted, and its application. */
export function AlignAnswer() {
  const answer = estimate.answer.value;
  if (!answer) return null;
  return (
    <section class="stack" aria-label="Estimate">
      <Poses answer={answer} />
      <Trust answer={answer} />
      <Apply answer={answer} />
    </section>
  );
}
