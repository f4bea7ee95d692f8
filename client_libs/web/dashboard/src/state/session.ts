// Signing in and out at the gateway, which keeps the token of a browser in a cookie that scripts
// can't read.
import { signal } from '@preact/signals';
import { tryAgain } from './connection';

/** Whether the gateway has not answered yet. */
export const signing = signal(false);
/** The reason why signing in or out has failed. Undefined if it has not. */
export const sessionProblem = signal<string>();

/** Signs in with a token and reconnects. */
export async function signIn(token: string): Promise<void> {
  // Forms of other sites can't send this type, so the gateway insists on it.
  const headers = { 'Content-Type': 'application/json' };
  if (await change({ method: 'POST', headers, body: JSON.stringify({ token }) })) tryAgain();
}

/** Signs out and loads the page anew, so that it keeps nothing that it has shown. */
export async function signOut(): Promise<void> {
  if (await change({ method: 'DELETE' })) location.reload();
}

/** Changes the session. Returns whether the gateway has done so. */
async function change(request: RequestInit): Promise<boolean> {
  signing.value = true;
  sessionProblem.value = undefined;
  try {
    const answer = await fetch('/session', request);
    if (!answer.ok) sessionProblem.value = (await answer.text()).trim() || answer.statusText;
    return answer.ok;
  } catch {
    sessionProblem.value = "The gateway can't be reached.";
    return false;
  } finally {
    signing.value = false;
  }
}
