import { useEffect } from 'preact/hooks';
import { MapView } from '../map/map_view';
import { askOnClick } from '../panels/click_question';
import { addEditKeys } from '../panels/edit_keys';
import { listenForShortcuts } from '../panels/kit/shortcuts';
import { may } from '../state/caller';
import { mapName } from '../state/site';
import './base.css';
import { Help } from './help';
import { addPageKeys } from './keys';
import { Layout } from './layout';

export function App() {
  const mayEdit = may('EditService/ApplyEdits');
  useEffect(listenForShortcuts, []);
  useEffect(addPageKeys, []);
  useEffect(() => (mayEdit ? addEditKeys() : undefined), [mayEdit]);
  useEffect(askOnClick, []);
  useEffect(() => {
    document.title = mapName.value === undefined ? 'Hypermap' : `${mapName.value} · Hypermap`;
  }, [mapName.value]);
  return (
    <>
      <MapView />
      <Layout />
      <Help />
    </>
  );
}
