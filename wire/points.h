// Batches of points and their answers on the wire: columns, and labels told once a stream.
#ifndef HYPERMAP_WIRE_POINTS_H_
#define HYPERMAP_WIRE_POINTS_H_

#include <cstddef>
#include <cstdint>
#include <deque>
#include <string>
#include <vector>

#include "absl/container/flat_hash_map.h"
#include "absl/status/status.h"
#include "absl/types/span.h"
#include "hypermap/v1/query_service.pb.h"
#include "map/query/query.h"

namespace hypermap::wire {

// Puts the batch in place of what `points` held. RESOURCE_EXHAUSTED for more than `max_points`;
// INVALID_ARGUMENT when there are not as many ys as xs, or naming the one that is not finite.
absl::Status DecodePoints(const v1::QueryPointsRequest& message, int max_points,
                          std::vector<Point>* points);
// Adds the batch to the message.
void EncodePoints(absl::Span<const Point> points, v1::QueryPointsRequest* message);

// The labels that a stream has told, numbered from 0. One for each stream; not thread safe.
class ToldLabels {
 public:
  // The label's number. A label that comes for the first time is added to `new_labels`.
  uint32_t Tell(const std::string& label,
                google::protobuf::RepeatedPtrField<std::string>* new_labels) {
    const auto [it, is_new] = numbers_.try_emplace(label, static_cast<uint32_t>(numbers_.size()));
    if (is_new) *new_labels->Add() = label;
    return it->second;
  }

 private:
  absl::flat_hash_map<std::string, uint32_t> numbers_;
};

// Adds the layers' answers, and the labels that `labels` has not told, to a message. With a message
// that is cleared and filled again nothing is allocated but for new labels.
void EncodePointsContent(absl::Span<const LayerPointsContent> contents, ToldLabels* labels,
                         v1::QueryPointsResponse* message);

// The labels that a stream was told. References stay valid while more are added.
class HeardLabels {
 public:
  void Add(const google::protobuf::RepeatedPtrField<std::string>& new_labels) {
    labels_.insert(labels_.end(), new_labels.begin(), new_labels.end());
  }
  size_t size() const { return labels_.size(); }
  // number < size().
  const std::string& operator[](uint32_t number) const { return labels_[number]; }

 private:
  std::deque<std::string> labels_;
};

// What one layer says of the points of a batch.
struct PointsAnswer {
  struct Hit {
    uint32_t point;
    ObjectId object_id;
    uint32_t label;  // its number
    float existence;
  };
  std::string layer;
  LayerKind kind = LayerKind::kSemantic;
  AnswerStatus status = AnswerStatus::kValue;
  std::vector<AnswerStatus> statuses;
  std::vector<double> values;
  std::vector<Hit> hits;  // by point, then id
};

// An answer to a batch of `num_points`, with `num_labels` told up to it. INVALID_ARGUMENT for
// columns that don't fit together, and for what points outside of the batch or of the labels.
absl::StatusOr<PointsAnswer> DecodePointsContent(absl::string_view field,
                                                 const v1::PointsContent& message,
                                                 size_t num_points, size_t num_labels);

}  // namespace hypermap::wire

#endif  // HYPERMAP_WIRE_POINTS_H_
