// Who uses the page, and what the server lets them do.
import { Role, type GetCallerResponse } from '@hypermap/client';
import { effect, signal, untracked } from '@preact/signals';
import { client, status } from './connection';

/** The caller as the server knows it. Undefined until the server has answered. */
export const caller = signal<GetCallerResponse>();

/** The rpcs that some callers may not call and the page would. */
export type RestrictedRpc =
  'CatalogService/BackupMap' | 'CatalogService/SetTransform' | 'EditService/ApplyEdits';

/**
 * Whether the caller may call an rpc for the maps that are listed, or needs none. True until the
 * server has answered: the server has the last word anyway.
 */
export function may(rpc: RestrictedRpc | undefined): boolean {
  const known = caller.value;
  if (rpc === undefined || !known?.hasIdentities) return true;
  const row = known.rpcs.find((each) => each.rpc === `hypermap.v1.${rpc}`);
  return known.role >= (row?.least ?? Role.UNSPECIFIED);
}

async function load(): Promise<void> {
  try {
    caller.value = await client.value.access.getCaller({});
  } catch {
    // The watch reports the connection's errors, and an older server does not have the rpc.
  }
}

/** Asks for the caller now and after each break of the connection, when its role may be another. */
export function startCaller(): void {
  effect(() => {
    if (status.value === 'live') void untracked(load);
  });
}
