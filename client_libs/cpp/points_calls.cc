// QueryPoints of Client.
#include <deque>
#include <memory>
#include <string>
#include <utility>

#include "absl/base/thread_annotations.h"
#include "base/status/status_macros.h"
#include "base/sync/deadline.h"
#include "base/sync/mutex.h"
#include "client_libs/cpp/client.h"
#include "client_libs/cpp/connection.h"
#include "client_libs/cpp/points_stream.h"
#include "wire/answer.h"
#include "wire/points.h"
#include "wire/scope.h"

namespace hypermap::client {
namespace {

using PointsRpc = grpc::ClientReaderWriter<v1::QueryPointsRequest, v1::QueryPointsResponse>;

LayerPoints WithLabels(wire::PointsAnswer decoded, const wire::HeardLabels& labels) {
  LayerPoints layer{std::move(decoded.layer),
                    decoded.kind,
                    decoded.status,
                    std::move(decoded.statuses),
                    std::move(decoded.values),
                    {}};
  layer.hits.reserve(decoded.hits.size());
  for (const wire::PointsAnswer::Hit& hit : decoded.hits) {
    layer.hits.push_back({hit.point, hit.object_id, labels[hit.label], hit.existence});
  }
  return layer;
}

}  // namespace

// The rpc and the list of labels that it has sent.
class PointsStream::Call {
 public:
  Call(std::shared_ptr<Connection> connection, const Deadline& deadline,
       v1::QueryPointsOpening opening)
      : connection_(std::move(connection)),
        context_(Connection::NewContext(deadline)),
        map_(opening.scope().map()),
        server_(connection_->servers().current()),
        stream_(server_.stub<v1::QueryService::Stub>().QueryPoints(context_.get())) {
    *request_.mutable_opening() = std::move(opening);
  }
  ~Call() {
    if (finished_) return;
    context_->TryCancel();
    Finish();
  }

  bool Write(absl::Span<const Point> points) {
    if (points.empty()) return true;
    wire::EncodePoints(points, &request_);
    {
      const MutexLock lock(&mutex_);
      sizes_.push_back(points.size());
    }
    return Send();
  }

  void WritesDone() {
    // If no batch was written, the opening is sent alone, so that the server can check it.
    if (request_.has_opening()) Send();
    stream_->WritesDone();
  }

  std::optional<PointsAnswer> Read() {
    if (finished_) return std::nullopt;
    if (!stream_->Read(&response_)) {
      Finish();
      return std::nullopt;
    }
    connection_->Note(map_, response_);
    absl::StatusOr<PointsAnswer> answer = Decode();
    if (answer.ok()) return *std::move(answer);
    context_->TryCancel();
    Finish();
    status_ = BadAnswer(answer.status());
    return std::nullopt;
  }

  void Cancel() { context_->TryCancel(); }
  const absl::Status& status() const { return status_; }

 private:
  bool Send() {
    const bool sent = stream_->Write(request_);
    request_.Clear();
    return sent;
  }

  absl::StatusOr<PointsAnswer> Decode() {
    PointsAnswer answer;
    answer.revision = response_.revision();
    answer.incarnation = response_.incarnation();
    {
      const MutexLock lock(&mutex_);
      if (sizes_.empty()) return absl::InternalError("an answer that was not asked for");
      answer.num_points = sizes_.front();
      sizes_.pop_front();
    }
    labels_.Add(response_.new_labels());
    for (const v1::PointsContent& content : response_.layers()) {
      HYPERMAP_ASSIGN_OR_RETURN(
          wire::PointsAnswer layer,
          wire::DecodePointsContent(content.layer(), content, answer.num_points, labels_.size()));
      answer.layers.push_back(WithLabels(std::move(layer), labels_));
    }
    return answer;
  }

  void Finish() {
    if (finished_) return;
    v1::QueryPointsResponse ignored;
    while (stream_->Read(&ignored)) {
    }
    const grpc::Status status = stream_->Finish();
    connection_->servers().NoteEnd(server_, status);
    status_ = wire::DecodeStatus(NamedStatus(status, *context_));
    finished_ = true;
  }

  const std::shared_ptr<Connection> connection_;
  const std::unique_ptr<grpc::ClientContext> context_;
  const std::string map_;
  Server& server_;
  const std::unique_ptr<PointsRpc> stream_;

  v1::QueryPointsRequest request_;  // used by the writer

  // Used by the reader.
  v1::QueryPointsResponse response_;
  wire::HeardLabels labels_;
  bool finished_ = false;
  absl::Status status_;

  Mutex mutex_;
  std::deque<size_t> sizes_ ABSL_GUARDED_BY(mutex_);  // of the unanswered batches
};

PointsStream::PointsStream(std::unique_ptr<Call> call) : call_(std::move(call)) {}
PointsStream::~PointsStream() = default;

absl::StatusOr<PointsAnswer> PointsStream::Ask(absl::Span<const Point> points) {
  if (points.empty()) return PointsAnswer();
  call_->Write(points);  // an error shows in Read
  std::optional<PointsAnswer> answer = call_->Read();
  if (answer) return *std::move(answer);
  if (!call_->status().ok()) return call_->status();
  return BadAnswer(absl::InternalError("the stream ended before it was closed"));
}
bool PointsStream::Write(absl::Span<const Point> points) { return call_->Write(points); }
void PointsStream::WritesDone() { call_->WritesDone(); }
std::optional<PointsAnswer> PointsStream::Read() { return call_->Read(); }
const absl::Status& PointsStream::status() const { return call_->status(); }
void PointsStream::Cancel() { call_->Cancel(); }

std::unique_ptr<PointsStream> Client::QueryPoints(const std::string& map, const Scope& scope,
                                                  const CallOptions& options) {
  v1::QueryPointsOpening opening;
  wire::EncodeScope(map, scope, opening.mutable_scope());
  opening.mutable_scope()->set_incarnation(options.incarnation);
  connection_->EncodeAsOf(map, options.as_of, &opening);
  opening.set_tolerance_m(options.tolerance_m);
  CallOptions of_stream = options;
  of_stream.timeout = options.timeout.value_or(absl::InfiniteDuration());
  return std::make_unique<PointsStream>(std::make_unique<PointsStream::Call>(
      connection_, connection_->DeadlineOf(of_stream), std::move(opening)));
}

}  // namespace hypermap::client
