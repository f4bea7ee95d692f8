export { createHypermapClient, type HypermapClient, type HypermapClientOptions } from './client.js';
export { watch, type WatchEvent, type WatchOptions, type WatchState } from './watch.js';
export { watchRobots, type RobotsState, type WatchRobotsOptions } from './robots.js';
export { backupMap, exportMap, type ExportedMap, type MapFile } from './files.js';
export {
  lineStringFromGeoJson,
  lineStringToGeoJson,
  objectToFeature,
  pointFromGeoJson,
  pointToGeoJson,
  polygonFromGeoJson,
  polygonToGeoJson,
  shapeFromGeoJson,
  shapeToGeoJson,
  type ObjectProperties,
  type ShapeGeometry,
} from './geojson.js';
export { runsOf, runToGeoJson, type CellRun } from './cells.js';
export { isTransient } from './retry.js';
export { newRequestId } from './request_id.js';

export * from './gen/hypermap/v1/access_service_pb.js';
export * from './gen/hypermap/v1/catalog_service_pb.js';
export * from './gen/hypermap/v1/edit_pb.js';
export * from './gen/hypermap/v1/edit_service_pb.js';
export * from './gen/hypermap/v1/exploration_service_pb.js';
export * from './gen/hypermap/v1/geometry_pb.js';
export * from './gen/hypermap/v1/ingest_service_pb.js';
export * from './gen/hypermap/v1/layer_pb.js';
export * from './gen/hypermap/v1/object_pb.js';
export * from './gen/hypermap/v1/observation_pb.js';
export * from './gen/hypermap/v1/query_service_pb.js';
export * from './gen/hypermap/v1/robot_service_pb.js';
export * from './gen/hypermap/v1/scope_pb.js';
export * from './gen/hypermap/v1/server_service_pb.js';
export * from './gen/hypermap/v1/watch_service_pb.js';

// Re-exports of the underlying libraries, so that callers need not depend on matching versions.
export { create, toJson, type MessageInitShape } from '@bufbuild/protobuf';
export { timestampDate, timestampFromDate } from '@bufbuild/protobuf/wkt';
export { Code, ConnectError } from '@connectrpc/connect';
