import { classColour, colourAt, css } from '../map/colours';
import { rampOf } from '../map/grid_palette';
import { classCounts } from '../state/class_counts';
import type { GridStore } from '../state/grid_store';
import { binaryValues, contentOf, valueRange } from '../state/layer_content';
import type { Layer } from '../state/model';
import type { ObjectStore } from '../state/object_store';
import { signal } from '@preact/signals';
import { dark } from '../state/theme';
import { shown } from '../state/time';
import { cellWords } from '../state/words';

/** The number of classes that are listed until the user expands the list. */
const FIRST_CLASSES = 8;

/** The layers whose list of classes is expanded. */
const unfolded = signal<ReadonlySet<string>>(new Set());

function Ramp({ layer, from, to }: { layer: Layer; from: string; to: string }) {
  const ramp = rampOf(layer, dark.value);
  const stops = [0, 0.25, 0.5, 0.75, 1].map((place) => {
    const [r, g, b, alpha] = colourAt(ramp, place);
    return css([r, g, b], alpha / 255);
  });
  return (
    <div class="ramp">
      <div class="ramp-bar" style={{ background: `linear-gradient(to right, ${stops.join()})` }} />
      <span>{from}</span>
      <span>{to}</span>
    </div>
  );
}

function formatted(value: number, unit: string): string {
  const text = value.toLocaleString(undefined, { maximumSignificantDigits: 4 });
  return unit ? `${text} ${unit}` : text;
}

function MeasurementsLegend({ layer, store }: { layer: Layer; store: GridStore }) {
  store.version.value; // Rendered again after each change, which may extend the range.
  const { min, max } = valueRange(layer) ?? store.range;
  const unit = layer.properties?.unit ?? '';
  return <Ramp layer={layer} from={formatted(min, unit)} to={formatted(max, unit)} />;
}

function BinaryLegend({ layer }: { layer: Layer }) {
  const ramp = rampOf(layer, dark.value);
  const { min, max } = binaryValues(layer);
  return (
    <ul class="classes">
      {[min, max].map((value, place) => {
        const [r, g, b, alpha] = colourAt(ramp, place);
        return (
          <li key={value} class="row">
            <span class="swatch" style={{ background: css([r, g, b], alpha / 255) }} />
            {cellWords(layer, value)}
          </li>
        );
      })}
    </ul>
  );
}

function ClassLegend({ layer, store }: { layer: Layer; store: ObjectStore }) {
  store.version.value; // Rendered again after each change.
  const all = classCounts(store.objects.values());
  const listed = unfolded.value.has(layer.name) ? all : all.slice(0, FIRST_CLASSES);
  return (
    <>
      <ul class="classes">
        {listed.map(({ label, count }) => (
          <li key={label} class="row">
            <span class="swatch" style={{ background: css(classColour(label, dark.value)) }} />
            <span class="grow cut">{label}</span>
            <span class="soft number">{count.toLocaleString()}</span>
          </li>
        ))}
      </ul>
      {listed.length < all.length && (
        <button
          class="link"
          onClick={() => (unfolded.value = new Set(unfolded.value).add(layer.name))}
        >
          {all.length - listed.length} more classes
        </button>
      )}
    </>
  );
}

/** The legend of a layer's colours. */
export function Legend({ layer }: { layer: Layer }) {
  const store = shown.value.stores.value.get(layer.name);
  if (!store) return <p class="soft">This layer is empty.</p>;
  if (store.type === 'objects') return <ClassLegend layer={layer} store={store} />;
  switch (contentOf(layer)) {
    case 'floor':
      return <Ramp layer={layer} from="free" to="occupied" />;
    case 'binary':
      return <BinaryLegend layer={layer} />;
    default:
      return <MeasurementsLegend layer={layer} store={store} />;
  }
}
