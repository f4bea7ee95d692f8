// Queries of many points, batch by batch.
//
//    std::unique_ptr<PointsStream> stream = client.QueryPoints("office");
//    absl::StatusOr<PointsAnswer> answer = stream->Ask(points);
//
// It is faster to have several batches under way at a time:
//
//    stream->Write(first);
//    stream->Write(second);
//    stream->WritesDone();
//    while (std::optional<PointsAnswer> answer = stream->Read()) Use(*answer);
//    absl::Status status = stream->status();
#ifndef HYPERMAP_CLIENT_LIBS_CPP_POINTS_STREAM_H_
#define HYPERMAP_CLIENT_LIBS_CPP_POINTS_STREAM_H_

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"
#include "absl/types/span.h"
#include "map/geometry/point.h"
#include "map/layers/layer.h"
#include "map/snapshot.h"

namespace hypermap::client {

// The answer of one layer to a batch of points.
struct LayerPoints {
  // An object at the point with index `point` in the batch.
  struct Hit {
    uint32_t point = 0;
    ObjectId object_id = 0;
    absl::string_view label;  // valid as long as the stream, or as PointsAnswer::labels_in
    float existence = 0.0F;
  };
  std::string layer;
  LayerKind kind = LayerKind::kSemantic;
  AnswerStatus status = AnswerStatus::kValue;  // kValue, or the reason why the layer can't answer
  std::vector<AnswerStatus> statuses;          // for grids, one for each point
  std::vector<double> values;                  // for grids, for each point; NaN if there is none
  std::vector<Hit> hits;                       // for semantic layers, sorted by point, then id
};

struct PointsAnswer {
  Revision revision = 0;
  size_t num_points = 0;            // in the batch
  std::vector<LayerPoints> layers;  // in the order of the scope; without one, by name
  // Owner of the labels in an answer that no stream gave (see Replica::QueryPoints).
  std::shared_ptr<const void> labels_in = nullptr;
  uint64_t incarnation = 0;  // of the map to which the revision belongs
};

// A call of QueryPoints. One thread may write while another reads; any thread may cancel.
class PointsStream {
 public:
  // The call itself. Only for the sources of this folder.
  class Call;

  explicit PointsStream(std::unique_ptr<Call> call);
  // Cancels the call if it has not finished.
  ~PointsStream();
  PointsStream(const PointsStream&) = delete;
  PointsStream& operator=(const PointsStream&) = delete;

  // Writes a batch and reads its answer. All earlier answers must have been read. A batch without
  // points has an answer without layers.
  absl::StatusOr<PointsAnswer> Ask(absl::Span<const Point> points);

  // Writer: sends a batch. Blocks while the server accepts no more, which is the case when more
  // than two answers are unread. Returns false if the stream broke; Read then returns nullopt, and
  // status() tells why. A batch without points is not sent.
  bool Write(absl::Span<const Point> points);
  // Writer: ends the batches. The server answers the batches it has, then ends the stream.
  void WritesDone();

  // Reader: returns the answer to the next batch, in order; nullopt at the end and on an error.
  // Blocks until there is one.
  std::optional<PointsAnswer> Read();
  // Reader: after the end, OK if every batch was answered, otherwise the error.
  const absl::Status& status() const;

  // Ends the stream as soon as possible.
  void Cancel();

 private:
  std::unique_ptr<Call> call_;
};

}  // namespace hypermap::client

#endif  // HYPERMAP_CLIENT_LIBS_CPP_POINTS_STREAM_H_
