// All rpcs that hypermapd serves, with the roles they need and the servers that answer them.
#ifndef HYPERMAP_SERVER_AUTH_RPCS_H_
#define HYPERMAP_SERVER_AUTH_RPCS_H_

#include <optional>

#include "absl/strings/string_view.h"
#include "absl/types/span.h"
#include "base/identity/role.h"

namespace hypermap::server {

enum class Rpc {
  // hypermap.v1.AccessService
  kGetCaller,
  // hypermap.v1.CatalogService
  kBackupMap,
  kCheckMap,
  kCreateLayer,
  kCreateMap,
  kDeleteLayer,
  kDeleteMap,
  kDigestMap,
  kExportMap,
  kGetLayer,
  kGetMap,
  kImportMap,
  kListLayers,
  kListMaps,
  kListTransforms,
  kRestoreMap,
  kSetTransform,
  // hypermap.v1.EditService
  kApplyEdits,
  // hypermap.v1.ExplorationService
  kClaimGoal,
  kGetExploration,
  kListExplorations,
  kListFrontiers,
  kReleaseGoal,
  kRenewGoal,
  kStartExploration,
  kStopExploration,
  // hypermap.v1.IngestService
  kCorrectPoses,
  kSmoothPoses,
  kExplainObject,
  kObserve,
  kRebuildLayer,
  kRetractSource,
  // hypermap.v1.QueryService
  kEstimateTransform,
  kQueryArea,
  kQueryNearest,
  kQueryPoint,
  kQueryPoints,
  kQueryValue,
  // hypermap.v1.RobotService
  kListRobots,
  kReport,
  kWatchRobots,
  // hypermap.v1.ServerService
  kDrainServer,
  kListServers,
  // hypermap.v1.WatchService
  kListChanges,
  kListRevisions,
  kReplicate,
  kWatch,
  // grpc.health.v1.Health and grpc.reflection.v1alpha.ServerReflection
  kHealth,
  kServerReflectionInfo,
};

// The server that answers a request about a map, if several share a store.
enum class AnsweredBy {
  kUnknown,  // no rpc has it
  // The server that was asked, from what it has of the map, which may be somewhat older than what
  // the owner has.
  kAnyServer,
  // The owner of the map, to which the others pass the request on: it changes the map, needs the
  // map's writer, or is about what only the owner has in memory.
  kOwner,
};

struct RpcInfo {
  Rpc rpc;
  absl::string_view service;  // with its package
  absl::string_view method;
  // None for health and reflection, which tell nothing of the maps; GrpcServer asks for an identity
  // before it tells the health of one.
  std::optional<access::Role> least;
  AnsweredBy answered_by;
};

const RpcInfo& InfoOf(Rpc rpc);

// A row for each rpc, in the order of the enumeration.
absl::Span<const RpcInfo> AllRpcs();

}  // namespace hypermap::server

#endif  // HYPERMAP_SERVER_AUTH_RPCS_H_
