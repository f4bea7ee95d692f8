// Calls of Client about observations and fused layers.
#include <deque>
#include <memory>
#include <string>
#include <utility>

#include "base/status/status_macros.h"
#include "base/sync/deadline.h"
#include "client_libs/cpp/client.h"
#include "client_libs/cpp/connection.h"
#include "client_libs/cpp/observe_stream.h"
#include "wire/ingest.h"
#include "wire/observation.h"
#include "wire/time.h"

namespace hypermap::client {
namespace {

using ObserveRpc = grpc::ClientReaderWriter<v1::ObserveRequest, v1::ObserveResponse>;

}  // namespace

// The rpc and the acknowledgements that were read but not yet returned.
class ObserveStream::Call {
 public:
  Call(std::shared_ptr<Connection> connection, const Deadline& deadline)
      : connection_(std::move(connection)),
        context_(Connection::NewContext(deadline)),
        server_(connection_->servers().current()),
        stream_(server_.stub<v1::IngestService::Stub>().Observe(context_.get())) {}
  ~Call() {
    if (finished_) return;
    context_->TryCancel();
    Finish();
  }

  absl::Status Open(const v1::ObserveOpening& opening) {
    v1::ObserveRequest request;
    *request.mutable_opening() = opening;
    stream_->Write(request);  // an error shows in Read and Finish
    v1::ObserveResponse response;
    if (!stream_->Read(&response)) {
      Finish();
      if (status_.ok()) return BadAnswer(absl::InternalError("the stream ended unopened"));
      return status_;
    }
    if (!response.has_opened()) {
      return BadAnswer(absl::InternalError("the first message does not open the stream"));
    }
    map_ = opening.map();
    opened_ = wire::DecodeOpened(response.opened());
    Keep(std::move(response));
    return absl::OkStatus();
  }

  bool Write(absl::Span<const Observation> observations) {
    v1::ObserveRequest request;
    for (const Observation& observation : observations) {
      wire::EncodeObservation(observation, request.add_observations());
    }
    return stream_->Write(request);
  }

  void WritesDone() { stream_->WritesDone(); }

  std::optional<Acknowledgement> Read() {
    while (read_.empty()) {
      v1::ObserveResponse response;
      if (finished_ || !stream_->Read(&response)) {
        Finish();
        return std::nullopt;
      }
      Keep(std::move(response));
    }
    absl::StatusOr<Acknowledgement> next = wire::DecodeVerdict(read_.front());
    read_.pop_front();
    if (next.ok()) {
      connection_->seen().Note(map_, {opened_.incarnation, next->revision});
      return *std::move(next);
    }
    context_->TryCancel();
    Finish();
    status_ = BadAnswer(next.status());
    return std::nullopt;
  }

  // After an error of Open: whether to open another call.
  bool ShallTryAgain(Retries& retries) const {
    return retries.ShallTryAgain(server_, end_, *context_);
  }

  void Cancel() { context_->TryCancel(); }
  const OpenedLayer& opened() const { return opened_; }
  const absl::Status& status() const { return status_; }

 private:
  void Keep(v1::ObserveResponse response) {
    for (v1::ObservationAcknowledgement& a : *response.mutable_acknowledgements()) {
      read_.push_back(std::move(a));
    }
  }

  void Finish() {
    if (finished_) return;
    v1::ObserveResponse ignored;
    while (stream_->Read(&ignored)) {
    }
    end_ = stream_->Finish();
    connection_->servers().NoteEnd(server_, end_);
    status_ = wire::DecodeStatus(NamedStatus(end_, *context_));
    finished_ = true;
  }

  const std::shared_ptr<Connection> connection_;
  const std::unique_ptr<grpc::ClientContext> context_;
  Server& server_;
  const std::unique_ptr<ObserveRpc> stream_;
  std::string map_;
  OpenedLayer opened_;
  std::deque<v1::ObservationAcknowledgement> read_;
  bool finished_ = false;
  grpc::Status end_;
  absl::Status status_;
};

ObserveStream::ObserveStream(std::unique_ptr<Call> call) : call_(std::move(call)) {}
ObserveStream::~ObserveStream() = default;
const OpenedLayer& ObserveStream::opened() const { return call_->opened(); }
bool ObserveStream::Write(const Observation& observation) {
  return call_->Write(absl::MakeConstSpan(&observation, 1));
}
bool ObserveStream::Write(absl::Span<const Observation> observations) {
  return call_->Write(observations);
}
void ObserveStream::WritesDone() { call_->WritesDone(); }
std::optional<Acknowledgement> ObserveStream::Read() { return call_->Read(); }
const absl::Status& ObserveStream::status() const { return call_->status(); }
void ObserveStream::Cancel() { call_->Cancel(); }

absl::StatusOr<std::unique_ptr<ObserveStream>> Client::Observe(
    const std::string& map, const std::string& layer, const ObserveOptions& observe_options,
    const CallOptions& options) {
  v1::ObserveOpening opening;
  opening.set_map(map);
  opening.set_layer(layer);
  opening.set_exploration_layer(observe_options.exploration_layer);
  opening.set_strategy(observe_options.strategy);
  opening.set_parameters(observe_options.parameters);
  opening.set_robot(observe_options.robot);
  CallOptions of_stream = options;
  of_stream.timeout = options.timeout.value_or(absl::InfiniteDuration());
  of_stream.retry_for = absl::ZeroDuration();
  const Deadline deadline = connection_->DeadlineOf(of_stream);
  Retries retries = connection_->RetriesOf(of_stream, deadline);
  while (true) {
    auto call = std::make_unique<ObserveStream::Call>(connection_, deadline);
    const absl::Status status = call->Open(opening);
    if (status.ok()) return std::make_unique<ObserveStream>(std::move(call));
    if (!call->ShallTryAgain(retries)) return status;
  }
}

absl::StatusOr<Revision> Client::RebuildLayer(const std::string& map, const std::string& layer,
                                              const std::string& strategy,
                                              const std::string& parameters,
                                              const CallOptions& options) {
  v1::RebuildLayerRequest request;
  request.set_map(map);
  request.set_layer(layer);
  request.set_strategy(strategy);
  request.set_parameters(parameters);
  request.set_request_id(RequestIdOf(options));
  request.set_incarnation(options.incarnation);
  HYPERMAP_ASSIGN_OR_RETURN(
      const auto response,
      connection_->Call(&v1::IngestService::Stub::RebuildLayer, request, options));
  return response.revision();
}

absl::StatusOr<Revision> Client::RetractSource(const std::string& map, const std::string& layer,
                                               const std::string& robot, absl::Time from,
                                               absl::Time to, const CallOptions& options) {
  v1::RetractSourceRequest request;
  request.set_map(map);
  request.set_layer(layer);
  request.set_robot(robot);
  if (from != absl::InfinitePast()) wire::EncodeTime(from, request.mutable_from());
  if (to != absl::InfiniteFuture()) wire::EncodeTime(to, request.mutable_to());
  request.set_request_id(RequestIdOf(options));
  request.set_incarnation(options.incarnation);
  HYPERMAP_ASSIGN_OR_RETURN(
      const auto response,
      connection_->Call(&v1::IngestService::Stub::RetractSource, request, options));
  return response.revision();
}

absl::StatusOr<SmoothingAnswer> Client::SmoothPoses(const std::string& map,
                                                    const std::string& layer,
                                                    const std::string& occupancy_layer,
                                                    const CallOptions& options) {
  v1::SmoothPosesRequest request;
  request.set_map(map);
  request.set_layer(layer);
  request.set_occupancy_layer(occupancy_layer);
  request.set_request_id(RequestIdOf(options));
  request.set_incarnation(options.incarnation);
  HYPERMAP_ASSIGN_OR_RETURN(
      const auto response,
      connection_->Call(&v1::IngestService::Stub::SmoothPoses, request, options));
  return SmoothingAnswer{response.revision(), response.matched(), response.moved(),
                         response.rms_shift_m(), response.occupancy_layer()};
}

absl::StatusOr<Revision> Client::CorrectPoses(const std::string& map, const std::string& layer,
                                              const PoseCorrection& correction,
                                              const std::string& frame_id,
                                              const CallOptions& options) {
  v1::CorrectPosesRequest request;
  request.set_map(map);
  request.set_layer(layer);
  request.set_robot(correction.robot);
  request.set_frame_id(frame_id);
  for (const CorrectedPose& pose : correction.poses) {
    wire::EncodeCorrectedPose(pose, request.add_poses());
  }
  request.set_request_id(RequestIdOf(options));
  request.set_incarnation(options.incarnation);
  HYPERMAP_ASSIGN_OR_RETURN(
      const auto response,
      connection_->Call(&v1::IngestService::Stub::CorrectPoses, request, options));
  return response.revision();
}

absl::StatusOr<ObjectHistory> Client::ExplainObject(const std::string& map,
                                                    const std::string& layer, ObjectId object_id,
                                                    const CallOptions& options) {
  v1::ExplainObjectRequest request;
  request.set_map(map);
  request.set_layer(layer);
  request.set_object_id(object_id);
  HYPERMAP_ASSIGN_OR_RETURN(
      const auto response,
      connection_->Call(&v1::IngestService::Stub::ExplainObject, request, options));
  absl::StatusOr<ObjectHistory> history = wire::DecodeObjectHistory(response);
  if (!history.ok()) return BadAnswer(history.status());
  return history;
}

}  // namespace hypermap::client
