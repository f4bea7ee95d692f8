#include "server/auth/rpcs.h"

#include <cstddef>

namespace hypermap::server {
namespace {

using access::Role;
using By = AnsweredBy;

constexpr char kAccessService[] = "hypermap.v1.AccessService";
constexpr char kCatalogService[] = "hypermap.v1.CatalogService";
constexpr char kEditService[] = "hypermap.v1.EditService";
constexpr char kExplorationService[] = "hypermap.v1.ExplorationService";
constexpr char kIngestService[] = "hypermap.v1.IngestService";
constexpr char kQueryService[] = "hypermap.v1.QueryService";
constexpr char kRobotService[] = "hypermap.v1.RobotService";
constexpr char kServerService[] = "hypermap.v1.ServerService";
constexpr char kWatchService[] = "hypermap.v1.WatchService";

constexpr RpcInfo kRpcs[] = {
    {Rpc::kGetCaller, kAccessService, "GetCaller", Role::kReader, By::kAnyServer},
    // A backup has all of the history.
    {Rpc::kBackupMap, kCatalogService, "BackupMap", Role::kAdmin, By::kOwner},
    {Rpc::kCheckMap, kCatalogService, "CheckMap", Role::kAdmin, By::kOwner},
    {Rpc::kCreateLayer, kCatalogService, "CreateLayer", Role::kEditor, By::kOwner},
    {Rpc::kCreateMap, kCatalogService, "CreateMap", Role::kAdmin, By::kOwner},
    {Rpc::kDeleteLayer, kCatalogService, "DeleteLayer", Role::kEditor, By::kOwner},
    {Rpc::kDeleteMap, kCatalogService, "DeleteMap", Role::kAdmin, By::kOwner},
    {Rpc::kDigestMap, kCatalogService, "DigestMap", Role::kReader, By::kAnyServer},
    {Rpc::kExportMap, kCatalogService, "ExportMap", Role::kReader, By::kAnyServer},
    {Rpc::kGetLayer, kCatalogService, "GetLayer", Role::kReader, By::kAnyServer},
    {Rpc::kGetMap, kCatalogService, "GetMap", Role::kReader, By::kAnyServer},
    // Makes a map if there is none of that name.
    {Rpc::kImportMap, kCatalogService, "ImportMap", Role::kAdmin, By::kOwner},
    {Rpc::kListLayers, kCatalogService, "ListLayers", Role::kReader, By::kAnyServer},
    // Lists the maps that the caller may see.
    {Rpc::kListMaps, kCatalogService, "ListMaps", Role::kReader, By::kAnyServer},
    {Rpc::kListTransforms, kCatalogService, "ListTransforms", Role::kReader, By::kAnyServer},
    // Replaces all of a map.
    {Rpc::kRestoreMap, kCatalogService, "RestoreMap", Role::kAdmin, By::kOwner},
    {Rpc::kSetTransform, kCatalogService, "SetTransform", Role::kEditor, By::kOwner},
    {Rpc::kApplyEdits, kEditService, "ApplyEdits", Role::kEditor, By::kOwner},
    {Rpc::kClaimGoal, kExplorationService, "ClaimGoal", Role::kRobot, By::kOwner},
    {Rpc::kGetExploration, kExplorationService, "GetExploration", Role::kReader, By::kOwner},
    {Rpc::kListExplorations, kExplorationService, "ListExplorations", Role::kReader,
     By::kAnyServer},
    {Rpc::kListFrontiers, kExplorationService, "ListFrontiers", Role::kReader, By::kOwner},
    {Rpc::kReleaseGoal, kExplorationService, "ReleaseGoal", Role::kRobot, By::kOwner},
    {Rpc::kRenewGoal, kExplorationService, "RenewGoal", Role::kRobot, By::kOwner},
    {Rpc::kStartExploration, kExplorationService, "StartExploration", Role::kEditor, By::kOwner},
    {Rpc::kStopExploration, kExplorationService, "StopExploration", Role::kEditor, By::kOwner},
    // A robot may correct its own poses only.
    {Rpc::kCorrectPoses, kIngestService, "CorrectPoses", Role::kRobot, By::kOwner},
    {Rpc::kSmoothPoses, kIngestService, "SmoothPoses", Role::kRobot, By::kOwner},
    {Rpc::kExplainObject, kIngestService, "ExplainObject", Role::kReader, By::kOwner},
    {Rpc::kObserve, kIngestService, "Observe", Role::kRobot, By::kOwner},
    {Rpc::kRebuildLayer, kIngestService, "RebuildLayer", Role::kEditor, By::kOwner},
    // A robot may retract its own observations only.
    {Rpc::kRetractSource, kIngestService, "RetractSource", Role::kRobot, By::kOwner},
    // Reads two maps, both of which the caller must have access to.
    {Rpc::kEstimateTransform, kQueryService, "EstimateTransform", Role::kReader, By::kAnyServer},
    {Rpc::kQueryArea, kQueryService, "QueryArea", Role::kReader, By::kAnyServer},
    {Rpc::kQueryNearest, kQueryService, "QueryNearest", Role::kReader, By::kAnyServer},
    {Rpc::kQueryPoint, kQueryService, "QueryPoint", Role::kReader, By::kAnyServer},
    {Rpc::kQueryPoints, kQueryService, "QueryPoints", Role::kReader, By::kAnyServer},
    {Rpc::kQueryValue, kQueryService, "QueryValue", Role::kReader, By::kAnyServer},
    {Rpc::kListRobots, kRobotService, "ListRobots", Role::kReader, By::kOwner},
    {Rpc::kReport, kRobotService, "Report", Role::kRobot, By::kOwner},
    {Rpc::kWatchRobots, kRobotService, "WatchRobots", Role::kReader, By::kOwner},
    // Needs the role for all maps.
    {Rpc::kDrainServer, kServerService, "DrainServer", Role::kAdmin, By::kAnyServer},
    // Lists the maps that the caller may see.
    {Rpc::kListServers, kServerService, "ListServers", Role::kReader, By::kAnyServer},
    {Rpc::kListChanges, kWatchService, "ListChanges", Role::kReader, By::kAnyServer},
    {Rpc::kListRevisions, kWatchService, "ListRevisions", Role::kReader, By::kAnyServer},
    {Rpc::kReplicate, kWatchService, "Replicate", Role::kReader, By::kAnyServer},
    {Rpc::kWatch, kWatchService, "Watch", Role::kReader, By::kAnyServer},
    {Rpc::kHealth, "grpc.health.v1.Health", "Health", std::nullopt, By::kAnyServer},
    {Rpc::kServerReflectionInfo, "grpc.reflection.v1alpha.ServerReflection", "ServerReflectionInfo",
     std::nullopt, By::kAnyServer},
};

constexpr bool IsInOrder() {
  size_t i = 0;
  for (const RpcInfo& info : kRpcs) {
    if (static_cast<size_t>(info.rpc) != i++ || info.answered_by == By::kUnknown) return false;
  }
  return true;
}
static_assert(IsInOrder());

}  // namespace

const RpcInfo& InfoOf(Rpc rpc) { return kRpcs[static_cast<size_t>(rpc)]; }

absl::Span<const RpcInfo> AllRpcs() { return kRpcs; }

}  // namespace hypermap::server
