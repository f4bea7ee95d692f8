#include "server/auth/rpcs.h"

#include <cstddef>

namespace hypermap::server {
namespace {

using access::Role;

constexpr char kAccessService[] = "hypermap.v1.AccessService";
constexpr char kCatalogService[] = "hypermap.v1.CatalogService";
constexpr char kEditService[] = "hypermap.v1.EditService";
constexpr char kExplorationService[] = "hypermap.v1.ExplorationService";
constexpr char kIngestService[] = "hypermap.v1.IngestService";
constexpr char kQueryService[] = "hypermap.v1.QueryService";
constexpr char kRobotService[] = "hypermap.v1.RobotService";
constexpr char kWatchService[] = "hypermap.v1.WatchService";

constexpr RpcInfo kRpcs[] = {
    {Rpc::kGetCaller, kAccessService, "GetCaller", Role::kReader},
    // A backup has all of the history.
    {Rpc::kBackupMap, kCatalogService, "BackupMap", Role::kAdmin},
    {Rpc::kCheckMap, kCatalogService, "CheckMap", Role::kAdmin},
    {Rpc::kCreateLayer, kCatalogService, "CreateLayer", Role::kEditor},
    {Rpc::kCreateMap, kCatalogService, "CreateMap", Role::kAdmin},
    {Rpc::kDeleteLayer, kCatalogService, "DeleteLayer", Role::kEditor},
    {Rpc::kDeleteMap, kCatalogService, "DeleteMap", Role::kAdmin},
    {Rpc::kExportMap, kCatalogService, "ExportMap", Role::kReader},
    {Rpc::kGetLayer, kCatalogService, "GetLayer", Role::kReader},
    {Rpc::kGetMap, kCatalogService, "GetMap", Role::kReader},
    // Makes a map if there is none of that name.
    {Rpc::kImportMap, kCatalogService, "ImportMap", Role::kAdmin},
    {Rpc::kListLayers, kCatalogService, "ListLayers", Role::kReader},
    // Lists the maps that the caller may see.
    {Rpc::kListMaps, kCatalogService, "ListMaps", Role::kReader},
    {Rpc::kListTransforms, kCatalogService, "ListTransforms", Role::kReader},
    // Replaces all of a map.
    {Rpc::kRestoreMap, kCatalogService, "RestoreMap", Role::kAdmin},
    {Rpc::kSetTransform, kCatalogService, "SetTransform", Role::kEditor},
    {Rpc::kApplyEdits, kEditService, "ApplyEdits", Role::kEditor},
    {Rpc::kClaimGoal, kExplorationService, "ClaimGoal", Role::kRobot},
    {Rpc::kGetExploration, kExplorationService, "GetExploration", Role::kReader},
    {Rpc::kListExplorations, kExplorationService, "ListExplorations", Role::kReader},
    {Rpc::kListFrontiers, kExplorationService, "ListFrontiers", Role::kReader},
    {Rpc::kReleaseGoal, kExplorationService, "ReleaseGoal", Role::kRobot},
    {Rpc::kRenewGoal, kExplorationService, "RenewGoal", Role::kRobot},
    {Rpc::kStartExploration, kExplorationService, "StartExploration", Role::kEditor},
    {Rpc::kStopExploration, kExplorationService, "StopExploration", Role::kEditor},
    {Rpc::kExplainObject, kIngestService, "ExplainObject", Role::kReader},
    {Rpc::kObserve, kIngestService, "Observe", Role::kRobot},
    {Rpc::kRebuildLayer, kIngestService, "RebuildLayer", Role::kEditor},
    // A robot may retract its own observations only.
    {Rpc::kRetractSource, kIngestService, "RetractSource", Role::kRobot},
    {Rpc::kQueryArea, kQueryService, "QueryArea", Role::kReader},
    {Rpc::kQueryNearest, kQueryService, "QueryNearest", Role::kReader},
    {Rpc::kQueryPoint, kQueryService, "QueryPoint", Role::kReader},
    {Rpc::kQueryPoints, kQueryService, "QueryPoints", Role::kReader},
    {Rpc::kQueryValue, kQueryService, "QueryValue", Role::kReader},
    {Rpc::kListRobots, kRobotService, "ListRobots", Role::kReader},
    {Rpc::kReport, kRobotService, "Report", Role::kRobot},
    {Rpc::kWatchRobots, kRobotService, "WatchRobots", Role::kReader},
    {Rpc::kListChanges, kWatchService, "ListChanges", Role::kReader},
    {Rpc::kListRevisions, kWatchService, "ListRevisions", Role::kReader},
    {Rpc::kReplicate, kWatchService, "Replicate", Role::kReader},
    {Rpc::kWatch, kWatchService, "Watch", Role::kReader},
    {Rpc::kHealth, "grpc.health.v1.Health", "Health", std::nullopt},
    {Rpc::kServerReflectionInfo, "grpc.reflection.v1alpha.ServerReflection", "ServerReflectionInfo",
     std::nullopt},
};

constexpr bool IsInOrder() {
  size_t i = 0;
  for (const RpcInfo& info : kRpcs) {
    if (static_cast<size_t>(info.rpc) != i++) return false;
  }
  return true;
}
static_assert(IsInOrder());

}  // namespace

const RpcInfo& InfoOf(Rpc rpc) { return kRpcs[static_cast<size_t>(rpc)]; }

absl::Span<const RpcInfo> AllRpcs() { return kRpcs; }

}  // namespace hypermap::server
