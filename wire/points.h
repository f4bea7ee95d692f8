// Batches of points and their answers on the wire: columns of numbers, with each label sent once
// per stream.
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

// Replaces the content of `points` by the batch. RESOURCE_EXHAUSTED for more than `max_points`;
// INVALID_ARGUMENT if the numbers of xs and ys differ, or naming a coordinate that is not finite.
absl::Status DecodePoints(const v1::QueryPointsRequest& message, int max_points,
                          std::vector<Point>* points);
// Adds the batch to the message.
void EncodePoints(absl::Span<const Point> points, v1::QueryPointsRequest* message);

// The labels that a stream has sent, numbered from 0. One per stream; not thread-safe.
class ToldLabels {
 public:
  // Returns the label's number. Adds a label that was not sent yet to `new_labels`.
  uint32_t Tell(const std::string& label,
                google::protobuf::RepeatedPtrField<std::string>* new_labels) {
    const auto [it, is_new] = numbers_.try_emplace(label, static_cast<uint32_t>(numbers_.size()));
    if (is_new) *new_labels->Add() = label;
    return it->second;
  }

 private:
  absl::flat_hash_map<std::string, uint32_t> numbers_;
};

// Adds the layers' answers, and the labels that were not sent yet, to a message. Reusing a cleared
// message allocates memory only for new labels.
void EncodePointsContent(absl::Span<const LayerPointsContent> contents, ToldLabels* labels,
                         v1::QueryPointsResponse* message);

// The labels that a client has received in a stream. References stay valid while labels are added.
class HeardLabels {
 public:
  void Add(const google::protobuf::RepeatedPtrField<std::string>& new_labels) {
    labels_.insert(labels_.end(), new_labels.begin(), new_labels.end());
  }
  size_t size() const { return labels_.size(); }
  // REQUIRES: number < size().
  const std::string& operator[](uint32_t number) const { return labels_[number]; }

 private:
  std::deque<std::string> labels_;
};

// The answer of one layer to a batch of points.
struct PointsAnswer {
  struct Hit {
    uint32_t point;
    ObjectId object_id;
    uint32_t label;  // The label's number.
    float existence;
  };
  std::string layer;
  LayerKind kind = LayerKind::kSemantic;
  AnswerStatus status = AnswerStatus::kValue;
  std::vector<AnswerStatus> statuses;
  std::vector<double> values;
  std::vector<Hit> hits;  // Sorted by point, then by id.
};

// Decodes a layer's answer to a batch of `num_points`; the stream has sent `num_labels` so far.
// INVALID_ARGUMENT if columns do not match in length, or a number refers to a point or label that
// does not exist.
absl::StatusOr<PointsAnswer> DecodePointsContent(absl::string_view field,
                                                 const v1::PointsContent& message,
                                                 size_t num_points, size_t num_labels);

}  // namespace hypermap::wire

#endif  // HYPERMAP_WIRE_POINTS_H_
