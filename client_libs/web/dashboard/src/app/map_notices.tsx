import type { ComponentChildren } from 'preact';
import { cancelTool, toolHint } from '../map/tools';
import { problem, signInWanted, status, tryAgain } from '../state/connection';
import { editProblem } from '../state/edits';
import { live, loading } from '../state/live';
import { formatTime } from '../panels/kit/format';
import { sessionProblem, signIn, signing } from '../state/session';
import { leftRevision } from '../state/show_map';
import { layers, mapName, maps } from '../state/site';
import { asOf, asOfCommit, asOfProblem, backToLive } from '../state/time';
import './map_notices.css';

function Notice({ kind, children }: { kind?: 'warn' | 'bad'; children: ComponentChildren }) {
  return (
    <div class={`card notice ${kind ?? ''}`} role={kind === 'bad' ? 'alert' : 'status'}>
      {children}
    </div>
  );
}

function SignInForm() {
  return (
    <Notice kind="warn">
      <form
        class="row"
        aria-label="Sign in"
        onSubmit={(event) => {
          event.preventDefault();
          void signIn(String(new FormData(event.currentTarget).get('token')).trim());
        }}
      >
        {sessionProblem.value ? (
          <span role="alert">{sessionProblem.value}</span>
        ) : (
          <span>{problem.value}</span>
        )}
        <input
          type="password"
          name="token"
          aria-label="Token"
          placeholder="Token"
          autocomplete="current-password"
          required
        />
        <button class="primary" disabled={signing.value}>
          Sign in
        </button>
      </form>
    </Notice>
  );
}

function SessionNotice() {
  if (signInWanted.value || sessionProblem.value === undefined) return null;
  return (
    <Notice kind="bad">
      <span>{sessionProblem.value}</span>
      <button onClick={() => (sessionProblem.value = undefined)}>Dismiss</button>
    </Notice>
  );
}

function ConnectionNotice() {
  if (signInWanted.value) return <SignInForm />;
  if (status.value === 'error') {
    return (
      <Notice kind="bad">
        <span class="grow">{problem.value}</span>
        <button onClick={tryAgain}>Try again</button>
      </Notice>
    );
  }
  if (status.value === 'disconnected') {
    return <Notice kind="warn">The server can't be reached. Trying again…</Notice>;
  }
  return null;
}

function AsOfNotice() {
  if (asOf.value === undefined) return null;
  const { revision, time } = asOfCommit.value ?? {};
  const when = time ? formatTime(time) : `revision ${asOf.value}`;
  return (
    <Notice kind="warn">
      <span>{revision === asOf.value ? `As of ${when}` : `Loading revision ${asOf.value}…`}</span>
      <button onClick={backToLive}>Back to live</button>
    </Notice>
  );
}

function LeftRevisionNotice() {
  if (leftRevision.value === undefined) return null;
  return (
    <Notice kind="warn">
      <span>
        Revision {String(leftRevision.value)} belongs to an earlier history of this map, which was
        restored or made anew.
      </span>
      <button onClick={() => (leftRevision.value = undefined)}>Dismiss</button>
    </Notice>
  );
}

function ContentNotice() {
  if (maps.value?.length === 0) return <Notice>There is no map on this server yet.</Notice>;
  if (mapName.value === undefined || status.value === 'error') return null;
  if (loading.value) return <Notice>Loading {mapName.value}…</Notice>;
  if (layers.value?.length === 0) return <Notice>This map has no layers yet.</Notice>;
  if (asOf.value === undefined && live.value.stores.value.size === 0) {
    return <Notice>The layers of this map are empty.</Notice>;
  }
  return null;
}

function EditNotice() {
  if (editProblem.value === undefined) return null;
  return (
    <Notice kind="bad">
      <span>{editProblem.value}</span>
      <button onClick={() => (editProblem.value = undefined)}>Dismiss</button>
    </Notice>
  );
}

function ToolNotice() {
  if (toolHint.value === undefined) return null;
  return (
    <Notice>
      <span>{toolHint.value}</span>
      <button onClick={cancelTool}>Cancel</button>
    </Notice>
  );
}

/**
 * Notices about the connection, the shown revision, the content, failed edits and the active tool.
 */
export function MapNotices() {
  return (
    <div class="notices">
      <ConnectionNotice />
      <SessionNotice />
      <AsOfNotice />
      <LeftRevisionNotice />
      {asOfProblem.value && <Notice kind="bad">{asOfProblem.value}</Notice>}
      <ContentNotice />
      <EditNotice />
      <ToolNotice />
    </div>
  );
}
