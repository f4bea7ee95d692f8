// Asking what is at many points, batch after batch.
//
//   std::unique_ptr<PointsStream> stream = client.QueryPoints("office");
//   absl::StatusOr<PointsAnswer> answer = stream->Ask(points);
//
// Faster, with some batches under way at a time:
//
//   stream->Write(first);
//   stream->Write(second);
//   stream->WritesDone();
//   while (std::optional<PointsAnswer> answer = stream->Read()) Use(*answer);
//   absl::Status status = stream->status();
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

// What one layer has at the points of a batch.
struct LayerPoints {
  // An object that covers point number `point` of the batch.
  struct Hit {
    uint32_t point = 0;
    ObjectId object_id = 0;
    absl::string_view label;  // lives as long as the stream, or as PointsAnswer::labels_in
    float existence = 0.0F;
  };
  std::string layer;
  LayerKind kind = LayerKind::kSemantic;
  AnswerStatus status = AnswerStatus::kValue;  // kValue, or why the layer can't answer
  std::vector<AnswerStatus> statuses;          // a grid's, for each point
  std::vector<double> values;                  // a grid's, for each point; NaN where there is none
  std::vector<Hit> hits;                       // a semantic layer's, by point, then id
};

struct PointsAnswer {
  Revision revision = 0;
  size_t num_points = 0;            // of the batch
  std::vector<LayerPoints> layers;  // in the order asked; all layers by name
  // Of an answer without a stream.
  std::shared_ptr<const void> labels_in = nullptr;
};

// One thread may write while another reads; Cancel may be called from any.
class PointsStream {
 public:
  // The call itself. Only for the sources of this folder.
  class Call;

  explicit PointsStream(std::unique_ptr<Call> call);
  // Cancels what is not finished.
  ~PointsStream();
  PointsStream(const PointsStream&) = delete;
  PointsStream& operator=(const PointsStream&) = delete;

  // Writes a batch and reads its answer; all earlier ones must have been read. A batch without
  // points has an answer without layers.
  absl::StatusOr<PointsAnswer> Ask(absl::Span<const Point> points);

  // Writer: sends a batch; blocks while the server takes no more, as it does with more than two
  // batches whose answers are not read. False when the stream broke: Read then ends, and status()
  // tells why. A batch without points is not sent.
  bool Write(absl::Span<const Point> points);
  // Writer: nothing more comes. The server answers what it has, then ends the stream.
  void WritesDone();

  // Reader: the answer to the next batch, in order; nullopt at the end and on an error. Blocks
  // until there is one.
  std::optional<PointsAnswer> Read();
  // Reader: after the end, OK when all that was written is answered, else why not.
  const absl::Status& status() const;

  // Ends the stream as soon as can be.
  void Cancel();

 private:
  std::unique_ptr<Call> call_;
};

}  // namespace hypermap::client

#endif  // HYPERMAP_CLIENT_LIBS_CPP_POINTS_STREAM_H_
