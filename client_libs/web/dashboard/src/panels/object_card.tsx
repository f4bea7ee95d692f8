import { timestampDate, type AttributeValue } from '@hypermap/client';
import type { ComponentChildren } from 'preact';
import { classColour, css } from '../map/colours';
import { evidence } from '../state/evidence';
import type { Object$ } from '../state/model';
import { kindOf } from '../state/shapes';
import { dark } from '../state/theme';
import { ago, authorWords, metres, percent, shapeWord, sizeWords } from '../state/words';
import { EvidenceSection } from './evidence_section';
import { Swatch } from './kit/swatch';
import { ObjectActions } from './object_actions';

interface Props {
  layer: string;
  object: Object$;
}

function Bar({ name, value, colour }: { name: string; value: number; colour: string }) {
  return (
    <div>
      <dt class="cut">{name}</dt>
      <dd class="bar-track">
        <span style={{ width: `${100 * Math.min(1, value)}%`, background: colour }} />
      </dd>
      <dd class="number">{percent(value)}</dd>
    </div>
  );
}

/** The existence probability and the class probabilities of an object. */
function Beliefs({ object }: { object: Object$ }) {
  const classes = Object.entries(object.classes).sort(([, a], [, b]) => b - a);
  return (
    <>
      <dl class="bars" aria-label="Existence">
        <Bar name="Existence" value={object.existence ?? 1} colour="var(--accent)" />
      </dl>
      {classes.length > 0 && (
        <section aria-label="Classes">
          <h3>Classes</h3>
          <dl class="bars">
            {classes.map(([name, p]) => (
              <Bar key={name} name={name} value={p} colour={css(classColour(name, dark.value))} />
            ))}
          </dl>
        </section>
      )}
    </>
  );
}

function Fact({ name, children }: { name: string; children: ComponentChildren }) {
  return (
    <>
      <dt>{name}</dt>
      <dd>{children}</dd>
    </>
  );
}

function attributeText({ value }: AttributeValue): string {
  return value.case === 'doubleValue'
    ? String(Number(value.value.toPrecision(6)))
    : String(value.value);
}

function LastChange({ objectId }: { objectId: bigint }) {
  const known = evidence.answer.value;
  const commit = known?.objectId === objectId ? known.commit : undefined;
  if (!commit?.time) return null;
  const time = timestampDate(commit.time);
  return (
    <Fact name="Last change">
      <span title={`Revision ${commit.revision}, ${time.toLocaleString()}`}>
        {ago(time, new Date())}
        {commit.author && ` by ${authorWords(commit.author)}`}
      </span>
    </Fact>
  );
}

function Facts({ object }: { object: Object$ }) {
  const { centroid, height, expireTime, attributes } = object;
  const kind = kindOf(object);
  return (
    <dl class="facts">
      {kind && <Fact name="Shape">{shapeWord(kind)}</Fact>}
      {kind && kind !== 'point' && (
        <Fact name={kind === 'polygon' ? 'Area' : 'Length'}>{sizeWords(object)}</Fact>
      )}
      {centroid && (
        <Fact name={kind === 'point' ? 'Position' : 'Centre'}>
          {centroid.x.toFixed(2)}, {centroid.y.toFixed(2)}
        </Fact>
      )}
      {height && (
        <Fact name="Height">
          {metres(height.lowM)} to {metres(height.highM)}
        </Fact>
      )}
      {expireTime && <Fact name="Expires">{timestampDate(expireTime).toLocaleString()}</Fact>}
      {Object.entries(attributes).map(([name, value]) => (
        <Fact key={name} name={name}>
          {attributeText(value)}
        </Fact>
      ))}
      <LastChange objectId={object.id} />
    </dl>
  );
}

/** All properties of an object, its evidence, and buttons to change it. */
export function ObjectCard({ layer, object }: Props) {
  const { id, label, tags } = object;
  return (
    <article class="object-card stack" aria-label={`Object ${label}`}>
      <header>
        <Swatch object={object} />
        <h3 class="grow cut">{label}</h3>
        <small class="number">
          {layer} {String(id)}
        </small>
      </header>
      <Beliefs object={object} />
      {tags.length > 0 && (
        <div class="chips" aria-label="Tags">
          {tags.map((tag) => (
            <span key={tag} class="tag">
              {tag}
            </span>
          ))}
        </div>
      )}
      <Facts object={object} />
      <ObjectActions layer={layer} object={object} />
      <EvidenceSection objectId={id} />
    </article>
  );
}
