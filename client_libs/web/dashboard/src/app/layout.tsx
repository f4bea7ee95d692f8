import { useEffect } from 'preact/hooks';
import { scale } from '../map/scale';
import { panels } from '../panels';
import { activePanel, openPanel, togglePanel } from '../panels/active';
import { CloseIcon } from '../panels/kit/icons';
import { addShortcut } from '../panels/kit/shortcuts';
import type { Panel } from '../panels/panel';
import { asOf } from '../state/time';
import { useCover } from './covered';
import { Header } from './header';
import './layout.css';
import { MapControls } from './map_controls';
import { MapNotices } from './map_notices';
import { ScaleLine } from './scale_line';
import { wide } from './wide';

function Tabs({ of }: { of: readonly Panel[] }) {
  return (
    <nav class="tabs" aria-label="Panels">
      {of.map(({ id, title, icon: TabIcon, shortcut }) => (
        <button
          key={id}
          aria-pressed={activePanel.value === id}
          title={`${title} (${shortcut})`}
          onClick={() => togglePanel(id)}
        >
          <TabIcon />
          <span>{title}</span>
        </button>
      ))}
    </nav>
  );
}

function PanelCard({ panel }: { panel: Panel }) {
  const { id, title, component: Content } = panel;
  return (
    <section class="card panel" aria-labelledby={`panel-${id}`}>
      <header class="row">
        <h2 id={`panel-${id}`} class="grow">
          {title}
        </h2>
        <button class="bare" aria-label={`Close ${title}`} onClick={() => togglePanel(id)}>
          <CloseIcon />
        </button>
      </header>
      <div class="panel-content">
        <Content />
      </div>
    </section>
  );
}

/** Focuses a panel that is always visible; opens any other panel. */
function goTo(id: string, place: Panel['place']): void {
  const section = document.getElementById(`section-${id}`);
  if (wide.value && place !== 'right' && section) {
    section.querySelector<HTMLElement>('input, button, select')?.focus();
  } else {
    openPanel(id);
  }
}

function Wide() {
  const cover = useCover();
  const open = panels.value.find(({ id, place }) => place === 'right' && id === activePanel.value);
  return (
    <div ref={cover} class="wide" style={{ '--scale': scale.value }}>
      <div class="left" data-covers="left">
        <Header />
        {panels.value
          .filter(({ place }) => place === 'left')
          .map(({ id, title, component: Content }) => (
            <section key={id} id={`section-${id}`} class="card panel" aria-label={title}>
              <h2 class="unseen">{title}</h2>
              <div class="panel-content">
                <Content />
              </div>
            </section>
          ))}
      </div>
      <div class="middle">
        <MapNotices />
        {panels.value
          .filter(({ place }) => place === 'bottom')
          .map(({ id, title, component: Content }) => (
            <section
              key={id}
              id={`section-${id}`}
              class="card bar"
              data-covers="bottom"
              aria-label={title}
            >
              <Content />
            </section>
          ))}
      </div>
      <div class="right" data-covers="right">
        {open && <PanelCard key={open.id} panel={open} />}
        <div class="rail">
          <Tabs of={panels.value.filter(({ place }) => place === 'right')} />
          <MapControls />
        </div>
        <ScaleLine />
      </div>
    </div>
  );
}

function Narrow() {
  const cover = useCover();
  const open = panels.value.find(({ id }) => id === activePanel.value);
  return (
    <div ref={cover} class="narrow" style={{ '--scale': scale.value }}>
      <Header covers="top" />
      <div class="middle">
        <MapNotices />
        <MapControls />
        <ScaleLine />
      </div>
      <div class="sheet" data-covers="bottom">
        {open && <PanelCard key={open.id} panel={open} />}
        <Tabs of={panels.value} />
      </div>
    </div>
  );
}

/** Everything that is drawn over the map, in the wide or the narrow layout. */
export function Layout() {
  useEffect(() => {
    const stops = panels.value.map(({ id, title, shortcut, place }) =>
      addShortcut({ key: shortcut, what: title, act: () => goTo(id, place) }),
    );
    return () => {
      for (const stop of stops) stop();
    };
  }, [panels.value]);
  return (
    <>
      {asOf.value !== undefined && <div class="as-of-frame" />}
      {wide.value ? <Wide /> : <Narrow />}
    </>
  );
}
