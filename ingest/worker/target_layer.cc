#include "ingest/worker/target_layer.h"

#include "absl/time/clock.h"
#include "absl/time/time.h"
#include "base/status/status_macros.h"

namespace hypermap::ingest {
namespace {

constexpr double kExplorationCell_m = 0.05;

// If two workers create the same map at once, the server answers ABORTED to one of them, which then
// tries again.
constexpr int kAttempts = 50;
constexpr absl::Duration kBetweenAttempts = absl::Milliseconds(100);

// Returns OK if the map or layer was created meanwhile (ALREADY_EXISTS), and otherwise `status`.
absl::Status UnlessThere(const absl::Status& status) {
  return absl::IsAlreadyExists(status) ? absl::OkStatus() : status;
}

absl::Status EnsureMap(client::Client& client, const TargetLayer& target) {
  absl::Status status;
  for (int attempt = 0; attempt < kAttempts; ++attempt) {
    if (attempt > 0) absl::SleepFor(kBetweenAttempts);
    status = client.GetMap(target.map).status();
    if (absl::IsNotFound(status)) {
      status = UnlessThere(client.CreateMap(target.map, target.frame_id).status());
    }
    if (!absl::IsAborted(status)) break;
  }
  return status;
}

absl::Status EnsureLayer(client::Client& client, const std::string& map, const LayerSpec& spec) {
  const absl::Status found = client.GetLayer(map, spec.name).status();
  if (!absl::IsNotFound(found)) return found;
  return UnlessThere(client.CreateLayer(map, spec).status());
}

}  // namespace

client::ObserveOptions ObserveOptionsOf(const TargetLayer& target) {
  client::ObserveOptions options;
  options.exploration_layer = target.exploration_layer;
  options.strategy = target.strategy;
  options.parameters = target.parameters;
  return options;
}

absl::Status EnsureTarget(client::Client& client, const TargetLayer& target) {
  absl::Status status = EnsureMap(client, target);
  HYPERMAP_RETURN_IF_ERROR(status);
  LayerSpec semantic;
  semantic.name = target.layer;
  semantic.kind = LayerKind::kSemantic;
  status = EnsureLayer(client, target.map, semantic);
  if (!status.ok() || target.exploration_layer.empty()) return status;
  LayerSpec exploration;
  exploration.name = target.exploration_layer;
  exploration.kind = LayerKind::kExploration;
  exploration.grid = GridGeometry{PlanarTransform(), kExplorationCell_m};
  return EnsureLayer(client, target.map, exploration);
}

}  // namespace hypermap::ingest
