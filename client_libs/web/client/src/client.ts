import { createClient, type Client, type Transport } from '@connectrpc/connect';
import { createGrpcWebTransport } from '@connectrpc/connect-web';
import { CatalogService } from './gen/hypermap/v1/catalog_service_pb.js';
import { EditService } from './gen/hypermap/v1/edit_service_pb.js';
import { ExplorationService } from './gen/hypermap/v1/exploration_service_pb.js';
import { IngestService } from './gen/hypermap/v1/ingest_service_pb.js';
import { QueryService } from './gen/hypermap/v1/query_service_pb.js';
import { WatchService } from './gen/hypermap/v1/watch_service_pb.js';
import { guard, type GuardOptions } from './guard.js';

/** The services of a Hypermap server. Methods of each are those of its .proto file. */
export interface HypermapClient {
  readonly catalog: Client<typeof CatalogService>;
  readonly query: Client<typeof QueryService>;
  readonly edit: Client<typeof EditService>;
  /** For watching without a gap there is `watch`. */
  readonly changes: Client<typeof WatchService>;
  readonly ingest: Client<typeof IngestService>;
  readonly exploration: Client<typeof ExplorationService>;
}

export type HypermapClientOptions = GuardOptions;

/**
 * Makes a client of a gateway's URL (by gRPC-Web, in browsers and Node), or of any transport: with
 * `createGrpcTransport` of @connectrpc/connect-node straight to a server. Nothing is sent yet.
 *
 * Every mutation gets a request id unless it has one, and calls that can do no harm twice are sent
 * again while the server can't be reached, see `retries`. Errors are `ConnectError`s.
 */
export function createHypermapClient(
  to: Transport | string | URL,
  options: HypermapClientOptions = {},
): HypermapClient {
  const transport = guard(isTransport(to) ? to : webTransport(to), options);
  return {
    catalog: createClient(CatalogService, transport),
    query: createClient(QueryService, transport),
    edit: createClient(EditService, transport),
    changes: createClient(WatchService, transport),
    ingest: createClient(IngestService, transport),
    exploration: createClient(ExplorationService, transport),
  };
}

function isTransport(to: Transport | string | URL): to is Transport {
  return typeof to !== 'string' && !(to instanceof URL);
}

// Not Connect, which tells errors by the HTTP status: browsers log each of those as a failure.
function webTransport(url: string | URL): Transport {
  return createGrpcWebTransport({ baseUrl: String(url).replace(/\/+$/, '') });
}
