import { createClient, type Client, type Transport } from '@connectrpc/connect';
import { createGrpcWebTransport } from '@connectrpc/connect-web';
import { AccessService } from './gen/hypermap/v1/access_service_pb.js';
import { CatalogService } from './gen/hypermap/v1/catalog_service_pb.js';
import { EditService } from './gen/hypermap/v1/edit_service_pb.js';
import { ExplorationService } from './gen/hypermap/v1/exploration_service_pb.js';
import { IngestService } from './gen/hypermap/v1/ingest_service_pb.js';
import { QueryService } from './gen/hypermap/v1/query_service_pb.js';
import { RobotService } from './gen/hypermap/v1/robot_service_pb.js';
import { ServerService } from './gen/hypermap/v1/server_service_pb.js';
import { WatchService } from './gen/hypermap/v1/watch_service_pb.js';
import { guard, type GuardOptions } from './guard.js';
import { monotonic } from './seen.js';

/** The services of a Hypermap server. Each has the methods of its .proto file. */
export interface HypermapClient {
  /** Tells who the caller is to the server, and what it may do. */
  readonly access: Client<typeof AccessService>;
  readonly catalog: Client<typeof CatalogService>;
  readonly query: Client<typeof QueryService>;
  readonly edit: Client<typeof EditService>;
  /** The function `watch` wraps this service and reconnects without missing a change. */
  readonly changes: Client<typeof WatchService>;
  readonly ingest: Client<typeof IngestService>;
  readonly exploration: Client<typeof ExplorationService>;
  /** The function `watchRobots` wraps this service and reconnects. */
  readonly robots: Client<typeof RobotService>;
  /** Tells which servers share a database, and who owns each map. */
  readonly servers: Client<typeof ServerService>;
}

export type HypermapClientOptions = GuardOptions;

/**
 * Creates a client for the URL of a gateway (gRPC-Web, in browsers and Node) or for any transport;
 * use `createGrpcTransport` of @connectrpc/connect-node to connect to a server directly. Sends
 * nothing.
 *
 * Every mutation gets a request id unless it has one. Idempotent calls are retried while the server
 * is unreachable, and after the wait that a full server asks for, see `retries`. Errors are
 * `ConnectError`s; `metadata.get('x-request-id')` is the name of the call in the server's log.
 */
export function createHypermapClient(
  to: Transport | string | URL,
  options: HypermapClientOptions = {},
): HypermapClient {
  const transport = guard(monotonic(isTransport(to) ? to : webTransport(to)), options);
  return {
    access: createClient(AccessService, transport),
    catalog: createClient(CatalogService, transport),
    query: createClient(QueryService, transport),
    edit: createClient(EditService, transport),
    changes: createClient(WatchService, transport),
    ingest: createClient(IngestService, transport),
    exploration: createClient(ExplorationService, transport),
    robots: createClient(RobotService, transport),
    servers: createClient(ServerService, transport),
  };
}

function isTransport(to: Transport | string | URL): to is Transport {
  return typeof to !== 'string' && !(to instanceof URL);
}

// Uses gRPC-Web, because the Connect protocol reports errors by HTTP status, and browsers log every
// such response as a failure.
function webTransport(url: string | URL): Transport {
  return createGrpcWebTransport({ baseUrl: String(url).replace(/\/+$/, '') });
}
