#include "server/services/estimate_transform.h"

#include <algorithm>
#include <cstdint>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/string_view.h"
#include "base/status/status_macros.h"
#include "hypermap/v1/query_service.pb.h"
#include "map/registration/layer_estimate.h"
#include "map/registration/point_pairs.h"
#include "map/registration/transform_answer.h"
#include "server/rpc/asked_revision.h"
#include "server/rpc/revision_wait.h"
#include "wire/registration.h"
#include "wire/scope.h"

namespace hypermap::server {
namespace {

using registration::PlacedLayer;
using registration::ReadSide;
using registration::TransformEstimate;
using EstimateCall = UnaryCallOf<v1::EstimateTransformRequest, v1::EstimateTransformResponse>;

// Bytes of an AgreeingPair in the answer.
constexpr int64_t kBytesOfPair = 36;

// The revisions that were waited for.
struct Reached {
  Revision source = 0;
  Revision target = 0;
};

// Names the side in an error, and keeps what else the error tells.
absl::Status OfSide(absl::string_view side, const absl::Status& status) {
  absl::Status named(status.code(), absl::StrCat(side, ": ", status.message()));
  status.ForEachPayload(
      [&](absl::string_view type, const absl::Cord& payload) { named.SetPayload(type, payload); });
  return named;
}

absl::StatusOr<AskedRevision> Pin(const Facilities& facilities,
                                  const v1::EstimateTransformSide& side, Revision reached) {
  HYPERMAP_ASSIGN_OR_RETURN(const std::shared_ptr<MapSession> session,
                            FindMap(facilities, side.scope()));
  HYPERMAP_ASSIGN_OR_RETURN(AsOf as_of, wire::DecodeAsOf(side.as_of()));
  as_of.min_revision = std::max(as_of.min_revision, reached);
  return AskedRevision::Find(*session, as_of);
}

// INVALID_ARGUMENT unless the side names as many layers as the estimate reads.
absl::Status CheckLayers(const v1::Scope& scope, bool from_pairs) {
  if (from_pairs && scope.layers_size() != 0) {
    return absl::InvalidArgumentError("scope.layers must be empty if there are pairs");
  }
  if (!from_pairs && scope.layers_size() != 1) {
    return absl::InvalidArgumentError(absl::StrCat(
        "scope.layers must name one layer if there are no pairs, but names ", scope.layers_size()));
  }
  return absl::OkStatus();
}

// One side as it is read. The layer is empty if the estimate is made from pairs.
struct Side {
  ReadSide read;
  PlacedLayer layer;
};

absl::StatusOr<Side> ReadUnnamed(const Facilities& facilities,
                                 const v1::EstimateTransformSide& side, Revision reached,
                                 bool from_pairs) {
  HYPERMAP_ASSIGN_OR_RETURN(const AskedRevision asked, Pin(facilities, side, reached));
  HYPERMAP_RETURN_IF_ERROR(CheckLayers(side.scope(), from_pairs));
  HYPERMAP_ASSIGN_OR_RETURN(const std::string frame, asked.ResolveFrame(side.scope().frame_id()));
  const std::string layer = from_pairs ? "" : side.scope().layers(0);
  Side found{{side.scope().map(), layer, frame, asked.revision(), asked.incarnation()}, {}};
  if (from_pairs) return found;
  HYPERMAP_ASSIGN_OR_RETURN(SnapshotPtr snapshot, asked.ForLayer(layer));
  found.layer = {std::move(snapshot), layer, frame};
  return found;
}

absl::StatusOr<Side> Read(const Facilities& facilities, absl::string_view name,
                          const v1::EstimateTransformSide& side, Revision reached,
                          bool from_pairs) {
  absl::StatusOr<Side> read = ReadUnnamed(facilities, side, reached, from_pairs);
  if (!read.ok()) return OfSide(name, read.status());
  return read;
}

absl::StatusOr<TransformEstimate> EstimateFrom(const std::vector<registration::NamedPair>& named) {
  std::vector<registration::PointPair> pairs;
  pairs.reserve(named.size());
  for (const registration::NamedPair& pair : named) pairs.push_back(pair.pair);
  return registration::EstimateFromPairs(pairs);
}

absl::StatusOr<int64_t> Answer(const Facilities& facilities, EstimateCall& call,
                               const Reached& reached) {
  const v1::EstimateTransformRequest& request = call.request();
  if (!request.has_source()) return absl::InvalidArgumentError("source is missing");
  if (!request.has_target()) return absl::InvalidArgumentError("target is missing");
  HYPERMAP_ASSIGN_OR_RETURN(const std::vector<registration::NamedPair> pairs,
                            wire::DecodePointPairs(request));
  const bool from_pairs = !pairs.empty();
  HYPERMAP_ASSIGN_OR_RETURN(
      Side source, Read(facilities, "source", request.source(), reached.source, from_pairs));
  HYPERMAP_ASSIGN_OR_RETURN(
      Side target, Read(facilities, "target", request.target(), reached.target, from_pairs));
  HYPERMAP_ASSIGN_OR_RETURN(TransformEstimate estimate,
                            from_pairs
                                ? EstimateFrom(pairs)
                                : registration::EstimateFromLayers(source.layer, target.layer));
  HYPERMAP_RETURN_IF_ERROR(
      call.ReserveAnswer(kBytesOfPair * static_cast<int64_t>(estimate.agreeing.size())));
  wire::EncodeTransformAnswer({std::move(source.read), std::move(target.read), std::move(estimate)},
                              call.response());
  return 1;
}

// Answers on a worker; with the error of the wait, if that has failed.
void AnswerAfterWaits(const Facilities& facilities, const std::shared_ptr<EstimateCall>& call,
                      const absl::Status& waited, const Reached& reached) {
  AnswerOn(
      &facilities.workers->estimates, call,
      [&facilities, call, waited, reached]() -> absl::StatusOr<int64_t> {
        HYPERMAP_RETURN_IF_ERROR(waited);
        return Answer(facilities, *call, reached);
      },
      Turns::kOnePerMap);
}

// Waits for the revision of the source, then for that of the target.
void AwaitBoth(const Facilities& facilities, const std::shared_ptr<EstimateCall>& call,
               RevisionWait& wait) {
  const v1::EstimateTransformSide& source = call->request().source();
  wait.Start(facilities, source.scope(), source.as_of(),
             [&facilities, call, &wait](const absl::StatusOr<Revision>& of_source) {
               if (!of_source.ok()) {
                 return AnswerAfterWaits(facilities, call, of_source.status(), {});
               }
               const v1::EstimateTransformSide& target = call->request().target();
               wait.Start(facilities, target.scope(), target.as_of(),
                          [&facilities, call, source_revision = *of_source](
                              const absl::StatusOr<Revision>& of_target) {
                            AnswerAfterWaits(facilities, call, of_target.status(),
                                             {source_revision, of_target.value_or(0)});
                          });
             });
}

}  // namespace

grpc::ServerUnaryReactor* EstimateTransform(const Facilities& facilities,
                                            grpc::CallbackServerContext* context,
                                            const RawMessages& raw) {
  const auto call = BeginCall<v1::EstimateTransformRequest, v1::EstimateTransformResponse>(
      facilities.for_calls(), context, Rpc::kEstimateTransform, raw);
  RevisionWait& wait = call->StartWait();
  const auto start = [&facilities, call, &wait] {
    AwaitBoth(facilities, call, wait);
    return absl::OkStatus();
  };
  return call->is_parsed() ? StartAtOnce(call, start)
                           : StartOn(&facilities.workers->long_questions, call, start);
}

}  // namespace hypermap::server
