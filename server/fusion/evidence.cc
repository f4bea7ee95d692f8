#include "server/fusion/evidence.h"

#include <utility>

#include "absl/strings/str_cat.h"

namespace hypermap::server {
namespace {

constexpr char kPin[] = "pin";
constexpr char kRemove[] = "remove";

absl::Status Damaged(const storage::LogKey& key, absl::string_view problem) {
  return absl::DataLossError(absl::StrCat("evidence of robot \"", key.after.robot, "\", sequence ",
                                          key.after.sequence, ": ", problem));
}

}  // namespace

absl::StatusOr<Evidence> DecodeEvidence(const storage::LogEntry& entry,
                                        const EvidenceCodec& codec) {
  if (entry.key.number == 0) {
    absl::StatusOr<Observation> observation = codec.decode_observation(entry.body);
    if (!observation.ok()) return Damaged(entry.key, observation.status().message());
    if (KeyOf(*observation) != entry.key.after) return Damaged(entry.key, "has another's body");
    return Evidence{entry.key, std::make_shared<const Observation>(*std::move(observation))};
  }
  if (entry.kind == kPosesKind && codec.decode_correction) {
    absl::StatusOr<PoseCorrection> correction = codec.decode_correction(entry.body);
    if (!correction.ok()) return Damaged(entry.key, correction.status().message());
    return Evidence{entry.key, nullptr, nullptr,
                    std::make_shared<const PoseCorrection>(*std::move(correction))};
  }
  if (entry.kind != kPin && entry.kind != kRemove) {
    return Damaged(entry.key, absl::StrCat("is of no known kind, ", entry.kind));
  }
  absl::StatusOr<SemanticObject> object = codec.decode_object(entry.body);
  if (!object.ok()) return Damaged(entry.key, object.status().message());
  const auto kind =
      entry.kind == kPin ? fusion::OperatorFact::Kind::kPin : fusion::OperatorFact::Kind::kRemove;
  return Evidence{entry.key, nullptr,
                  std::make_shared<const fusion::OperatorFact>(
                      fusion::OperatorFact{kind, entry.track, *std::move(object)})};
}

storage::EvidenceCheck CheckBy(const EvidenceCodec& codec) {
  if (!codec.decode_observation) return nullptr;
  return [codec](const storage::LogEntry& entry) { return DecodeEvidence(entry, codec).status(); };
}

storage::LoggedFact EncodeFact(const storage::LogKey& key, const fusion::OperatorFact& fact,
                               const EvidenceCodec& codec) {
  const bool pin = fact.kind == fusion::OperatorFact::Kind::kPin;
  return {key, pin ? kPin : kRemove, fact.track, codec.encode_object(fact.object)};
}

storage::LoggedFact EncodeFact(const storage::LogKey& key, const PoseCorrection& correction,
                               const EvidenceCodec& codec) {
  return {key, kPosesKind, "", codec.encode_correction(correction)};
}

fusion::StatePtr Fold(const fusion::Strategy& strategy, const fusion::StatePtr& state,
                      const Evidence& evidence, fusion::FoldReport* report) {
  if (evidence.correction) return state;
  if (evidence.fact) return strategy.Fold(state, *evidence.fact);
  return strategy.Fold(state, *evidence.observation, report);
}

}  // namespace hypermap::server
