#include "wire/registration.h"

#include <cmath>
#include <optional>
#include <string>
#include <utility>

#include "absl/strings/str_cat.h"
#include "base/status/status_macros.h"
#include "wire/enum_names.h"
#include "wire/field.h"
#include "wire/geometry.h"

namespace hypermap::wire {
namespace {

using registration::Ambiguity;
using registration::Mode;
using registration::NamedPair;
using registration::ReadSide;
using registration::TransformAnswer;

constexpr EnumNames<Ambiguity, v1::TransformAmbiguity, 4> kAmbiguities = {{
    {Ambiguity::kNone, v1::TRANSFORM_AMBIGUITY_NONE},
    {Ambiguity::kLittleAgreement, v1::TRANSFORM_AMBIGUITY_LITTLE_AGREEMENT},
    {Ambiguity::kRunnerUp, v1::TRANSFORM_AMBIGUITY_RUNNER_UP},
    {Ambiguity::kFreeDirection, v1::TRANSFORM_AMBIGUITY_FREE_DIRECTION},
}};

absl::StatusOr<NamedPair> DecodePair(const std::string& field, const v1::PointPair& message) {
  if (!message.has_source()) return InvalidField(field, "has no source");
  if (!message.has_target()) return InvalidField(field, "has no target");
  NamedPair pair;
  pair.name = message.name();
  HYPERMAP_ASSIGN_OR_RETURN(pair.pair.source,
                            DecodePoint(absl::StrCat(field, ".source"), message.source()));
  HYPERMAP_ASSIGN_OR_RETURN(pair.pair.target,
                            DecodePoint(absl::StrCat(field, ".target"), message.target()));
  const double sigma_m = message.sigma_m();
  if (!std::isfinite(sigma_m) || sigma_m < 0.0) {
    return InvalidField(
        absl::StrCat(field, ".sigma_m"),
        absl::StrCat("is ", sigma_m, ", but must be positive, or 0 for the default"));
  }
  if (sigma_m > 0.0) pair.pair.sigma_m = sigma_m;
  return pair;
}

void EncodeSide(const ReadSide& side, v1::EstimateTransformInput* message) {
  message->set_map(side.map);
  message->set_layer(side.layer);
  message->set_frame_id(side.frame_id);
  message->set_revision(side.revision);
  message->set_incarnation(side.incarnation);
}

ReadSide DecodeSide(const v1::EstimateTransformInput& message) {
  return {message.map(), message.layer(), message.frame_id(), message.revision(),
          message.incarnation()};
}

void EncodeMode(const Mode& mode, v1::ScoredTransform* message) {
  EncodePose(mode.target_from_source, message->mutable_target_from_source());
  message->set_score(mode.score);
}

absl::StatusOr<Mode> DecodeMode(absl::string_view field, const v1::ScoredTransform& message) {
  Mode mode;
  HYPERMAP_ASSIGN_OR_RETURN(
      mode.target_from_source,
      DecodePose(absl::StrCat(field, ".target_from_source"), message.target_from_source()));
  mode.score = message.score();
  return mode;
}

}  // namespace

void EncodePointPairs(absl::Span<const NamedPair> pairs, v1::EstimateTransformRequest* message) {
  for (const NamedPair& pair : pairs) {
    v1::PointPair* const encoded = message->add_pairs();
    encoded->set_name(pair.name);
    EncodePoint(pair.pair.source, encoded->mutable_source());
    EncodePoint(pair.pair.target, encoded->mutable_target());
    encoded->set_sigma_m(pair.pair.sigma_m);
  }
}

absl::StatusOr<std::vector<NamedPair>> DecodePointPairs(
    const v1::EstimateTransformRequest& message) {
  if (message.pairs_size() > registration::kMaxPointPairs) {
    return absl::ResourceExhaustedError(absl::StrCat(
        "pairs has ", message.pairs_size(), " elements, more than ", registration::kMaxPointPairs));
  }
  std::vector<NamedPair> pairs;
  pairs.reserve(message.pairs_size());
  for (const v1::PointPair& encoded : message.pairs()) {
    std::string field = absl::StrCat("pairs[", pairs.size(), "]");
    if (!encoded.name().empty()) absl::StrAppend(&field, " (\"", encoded.name(), "\")");
    HYPERMAP_ASSIGN_OR_RETURN(NamedPair pair, DecodePair(field, encoded));
    pairs.push_back(std::move(pair));
  }
  return pairs;
}

void EncodeTransformAnswer(const TransformAnswer& answer, v1::EstimateTransformResponse* message) {
  EncodeSide(answer.source, message->mutable_source());
  EncodeSide(answer.target, message->mutable_target());
  const registration::TransformEstimate& estimate = answer.estimate;
  EncodeMode(estimate.best, message->mutable_best());
  if (estimate.covariance.allFinite()) {
    EncodeCovariance(estimate.covariance, message->mutable_covariance());
  }
  message->set_inlier_share(estimate.inlier_share);
  if (estimate.runner_up) EncodeMode(*estimate.runner_up, message->mutable_runner_up());
  message->set_ambiguity(EncodeEnum(kAmbiguities, estimate.ambiguity));
  for (const registration::AgreeingPair& pair : estimate.agreeing) {
    v1::AgreeingPair* const encoded = message->add_agreeing();
    encoded->set_source(pair.source);
    encoded->set_target(pair.target);
    encoded->set_residual_m(pair.residual_m);
  }
}

absl::StatusOr<TransformAnswer> DecodeTransformAnswer(
    const v1::EstimateTransformResponse& message) {
  TransformAnswer answer;
  answer.source = DecodeSide(message.source());
  answer.target = DecodeSide(message.target());
  registration::TransformEstimate& estimate = answer.estimate;
  HYPERMAP_ASSIGN_OR_RETURN(estimate.best, DecodeMode("best", message.best()));
  HYPERMAP_ASSIGN_OR_RETURN(const std::optional<Eigen::Matrix3d> covariance,
                            DecodeCovariance("covariance", message.covariance()));
  if (covariance) estimate.covariance = *covariance;
  estimate.inlier_share = message.inlier_share();
  if (message.has_runner_up()) {
    HYPERMAP_ASSIGN_OR_RETURN(estimate.runner_up, DecodeMode("runner_up", message.runner_up()));
  }
  HYPERMAP_ASSIGN_OR_RETURN(estimate.ambiguity,
                            DecodeEnum(kAmbiguities, "ambiguity", message.ambiguity()));
  estimate.agreeing.reserve(message.agreeing_size());
  for (const v1::AgreeingPair& pair : message.agreeing()) {
    estimate.agreeing.push_back({pair.source(), pair.target(), pair.residual_m()});
  }
  return answer;
}

}  // namespace hypermap::wire
