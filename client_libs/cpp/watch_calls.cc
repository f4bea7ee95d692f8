// Calls of Client about revisions and changes.
#include <algorithm>
#include <memory>
#include <optional>
#include <string>
#include <thread>
#include <type_traits>
#include <utility>
#include <vector>

#include "absl/base/thread_annotations.h"
#include "absl/strings/str_cat.h"
#include "absl/time/time.h"
#include "base/status/status_macros.h"
#include "base/sync/deadline.h"
#include "base/sync/mutex.h"
#include "base/sync/steady_time.h"
#include "client_libs/cpp/channel.h"
#include "client_libs/cpp/client.h"
#include "client_libs/cpp/connection.h"
#include "client_libs/cpp/counted_response.h"
#include "client_libs/cpp/decode.h"
#include "client_libs/cpp/grpc_part_stream.h"
#include "client_libs/cpp/watch.h"
#include "wire/answer.h"
#include "wire/catalog.h"
#include "wire/change.h"
#include "wire/geometry.h"
#include "wire/scope.h"
#include "wire/time.h"

namespace hypermap::client {
namespace {

absl::StatusOr<ChangeReader::Part> DecodeDifference(v1::ListChangesResponse&& message) {
  ChangeReader::Part part{
      message.from_revision(), message.to_revision(), {}, message.incarnation()};
  HYPERMAP_RETURN_IF_ERROR(wire::AppendChanges(message.changes(), part.changes));
  return part;
}

v1::WatchRequest EncodeWatch(const std::string& map, const WatchOptions& options) {
  v1::WatchRequest request;
  wire::EncodeScope(map, options.scope, request.mutable_scope());
  request.mutable_scope()->set_incarnation(options.incarnation);
  if (options.area) wire::EncodePolygon(*options.area, request.mutable_area());
  request.mutable_classes()->Assign(options.classes.begin(), options.classes.end());
  if (options.start_revision) request.set_start_revision(*options.start_revision);
  request.set_coalesce(options.coalesce);
  return request;
}

v1::ReplicateRequest EncodeReplicate(const std::string& map, const ReplicateOptions& options) {
  v1::ReplicateRequest request;
  wire::EncodeScope(map, options.scope, request.mutable_scope());
  request.mutable_scope()->set_incarnation(options.incarnation);
  if (options.area) wire::EncodePolygon(*options.area, request.mutable_area());
  if (options.start_revision) request.set_start_revision(*options.start_revision);
  if (options.start_time) wire::EncodeTime(*options.start_time, request.mutable_start_time());
  return request;
}

}  // namespace

// Next runs on the caller's thread, Cancel on any; see Watcher.
class Watcher::Call {
 public:
  virtual ~Call() = default;
  virtual std::optional<WatchEvent> Next() = 0;
  virtual const absl::Status& status() const = 0;
  virtual std::optional<Revision> revision() const = 0;
  virtual uint64_t incarnation() const = 0;
  virtual int num_resumed() const = 0;
  virtual void Cancel() = 0;
};

namespace {

// Decides what happens after a break of a stream; see WatchOptions.
struct Breaks {
  bool resume = true;
  absl::Duration retry_for;
  absl::Duration idle_timeout;
  bool snapshot_when_compacted = false;
};

// The rpc Watch or Replicate, which is opened again after a break. Both have the same fields for
// what happens here.
template <typename Request, typename Response>
class StreamCall final : public Watcher::Call {
 public:
  using Method = std::unique_ptr<grpc::ClientReader<Response>> (*)(Connection&,
                                                                   grpc::ClientContext*,
                                                                   const Request&);

  StreamCall(std::shared_ptr<Connection> connection, Method method, Request request,
             const Breaks& breaks, const Deadline& deadline)
      : connection_(std::move(connection)),
        method_(method),
        breaks_(breaks),
        deadline_(deadline),
        request_(std::move(request)) {
    Open();
    if (breaks_.idle_timeout != absl::InfiniteDuration()) {
      watchdog_ = std::thread([this] { BreakSilence(); });
    }
  }

  ~StreamCall() override {
    Cancel();
    if (watchdog_.joinable()) watchdog_.join();
    Drain();
  }

  std::optional<WatchEvent> Next() override {
    while (!finished_) {
      Response message;
      if (!Read(message)) {
        Recover(wire::DecodeStatus(Close()));
        continue;
      }
      if (begun_ && broken_since_ != SteadyTime::InfiniteFuture()) ++num_resumed_;
      begun_ = true;
      broken_since_ = SteadyTime::InfiniteFuture();
      backoff_.Reset();
      const bool whole = !message.more();
      absl::Status status = Take(message);
      if (status.ok() && whole) status = CheckOrder();
      if (!status.ok()) {
        Cancel();
        Drain();
        Finish(BadAnswer(status));
      } else if (whole) {
        return Deliver();
      }
    }
    return std::nullopt;
  }

  const absl::Status& status() const override { return status_; }
  std::optional<Revision> revision() const override { return told_; }
  uint64_t incarnation() const override { return incarnation_; }
  int num_resumed() const override { return num_resumed_; }

  void Cancel() override {
    const MutexLock lock(&mutex_);
    cancelled_ = true;
    cancel_.NotifyAll();
    if (context_) context_->TryCancel();
  }

 private:
  void Open() {
    const MutexLock lock(&mutex_);
    context_ = Connection::NewContext(deadline_);
    if (cancelled_) context_->TryCancel();
    reader_ = method_(*connection_, context_.get(), request_);
  }

  // Reads the next message, taking coalesced messages apart.
  bool Read(Response& message) {
    while (next_coalesced_ == coalesced_.coalesced_size()) {
      ListenUntil(SteadyTime::Now() + breaks_.idle_timeout);
      const bool read = reader_->Read(&message);
      ListenUntil(SteadyTime::InfiniteFuture());
      if (!read || message.coalesced_size() == 0) return read;
      coalesced_.Swap(&message);
      next_coalesced_ = 0;
    }
    message = std::move(*coalesced_.mutable_coalesced(next_coalesced_++));
    return true;
  }

  void ListenUntil(SteadyTime time) {
    const MutexLock lock(&mutex_);
    listen_until_ = time;
  }

  // Runs on the watchdog's thread. Cancels a call on which nothing arrives for idle_timeout, since
  // a dead connection may give no other sign.
  void BreakSilence() {
    const MutexLock lock(&mutex_);
    while (!cancelled_) {
      cancel_.WaitFor(&mutex_, breaks_.idle_timeout / 4);
      if (cancelled_ || SteadyTime::Now() < listen_until_ || !context_) continue;
      context_->TryCancel();
      listen_until_ = SteadyTime::InfiniteFuture();
    }
  }

  // Ends the call. Messages that have arrived are dropped.
  void Drain() {
    if (!reader_) return;
    Response ignored;
    while (reader_->Read(&ignored)) {
    }
    Close();
  }

  // Returns the status of a call whose last message has been read.
  grpc::Status Close() {
    grpc::Status status = reader_->Finish();
    const MutexLock lock(&mutex_);
    reader_.reset();
    context_.reset();
    return status;
  }

  void Finish(absl::Status status) {
    finished_ = true;
    status_ = std::move(status);
  }

  absl::Status Take(const Response& message) {
    if (!pending_) pending_.emplace();
    pending_->revision = message.revision();
    pending_->incarnation = message.incarnation();
    if (message.has_time()) pending_->time = wire::DecodeTime(message.time());
    if (!message.author().empty()) pending_->author = message.author();
    if constexpr (requires { message.map(); }) {
      if (message.has_map()) pending_->map = wire::DecodeMapEntry(message.map());
    }
    pending_->snapshot |= message.snapshot();
    pending_->reset |= message.reset();
    if constexpr (requires { message.changes(); }) {
      pending_->num_changes += message.changes_size();
      return wire::AppendChanges(message.changes(), pending_->changes);
    } else {
      pending_->num_changes += message.num_changes();
      return absl::OkStatus();
    }
  }

  // INVALID_ARGUMENT if the server repeats a revision or goes back.
  absl::Status CheckOrder() const {
    if (!told_ || pending_->snapshot) return absl::OkStatus();
    const bool in_order =
        pending_->num_changes == 0 ? pending_->revision >= *told_ : pending_->revision > *told_;
    if (in_order) return absl::OkStatus();
    return absl::InvalidArgumentError(
        absl::StrCat("revision ", pending_->revision, " was told after ", *told_));
  }

  WatchEvent Deliver() {
    told_ = pending_->revision;
    incarnation_ = pending_->incarnation;
    request_.set_start_revision(*told_);
    request_.mutable_scope()->set_incarnation(incarnation_);
    if (pending_->snapshot) pending_->reset |= std::exchange(starts_anew_, false);
    WatchEvent event = *std::move(pending_);
    pending_.reset();
    return event;
  }

  // Opens the next call, after a break with a pause, or finishes the watch.
  void Recover(absl::Status why) {
    pending_.reset();
    if (NeedsSnapshot(why) && breaks_.snapshot_when_compacted && request_.has_start_revision()) {
      request_.clear_start_revision();
      request_.mutable_scope()->clear_incarnation();
      starts_anew_ = true;
      // The server has answered, and can be asked at once.
      broken_since_ = std::min(broken_since_, SteadyTime::Now());
      if (cancelled()) return Finish(absl::CancelledError("the watch was cancelled"));
      return Open();
    }
    if (!MayGoOn(why)) return Finish(std::move(why));
    const absl::Duration retry_for = begun_ ? breaks_.retry_for : connection_->options().retry_for;
    broken_since_ = std::min(broken_since_, SteadyTime::Now());
    const absl::Duration pause = backoff_.Next();
    if (SteadyTime::Now() + pause >= broken_since_ + retry_for || pause >= deadline_.left()) {
      return Finish(std::move(why));
    }
    Pause(connection_->channel(), pause, [this] { return cancelled(); });
    if (cancelled()) return Finish(absl::CancelledError("the watch was cancelled"));
    Open();
  }

  // Whether the server can't continue from the revision that was asked for: its changes are no
  // longer kept, or the map is another incarnation.
  bool NeedsSnapshot(const absl::Status& why) const {
    if (absl::IsAborted(why)) return request_.scope().incarnation() != 0;
    return absl::IsOutOfRange(why);
  }

  bool MayGoOn(const absl::Status& why) const {
    if (cancelled()) return false;
    if (!begun_) return absl::IsUnavailable(why);
    if (!breaks_.resume) return false;
    // A server that stops ends or cancels its watches. A server that finds this reader too slow
    // ends the watch with RESOURCE_EXHAUSTED.
    return why.ok() || absl::IsUnavailable(why) || absl::IsCancelled(why) ||
           absl::IsResourceExhausted(why);
  }

  bool cancelled() const {
    const MutexLock lock(&mutex_);
    return cancelled_;
  }

  const std::shared_ptr<Connection> connection_;
  const Method method_;
  const Breaks breaks_;
  const Deadline deadline_;
  Request request_;  // for the next call
  std::unique_ptr<grpc::ClientReader<Response>> reader_;
  Response coalesced_;  // the last message with several, and the index of the next of them
  int next_coalesced_ = 0;
  Backoff backoff_;
  SteadyTime broken_since_ = SteadyTime::InfiniteFuture();
  bool begun_ = false;
  bool starts_anew_ = false;           // the next snapshot replaces everything reported before
  std::optional<WatchEvent> pending_;  // the part of a revision that has arrived
  std::optional<Revision> told_;
  uint64_t incarnation_ = 0;  // to which told_ belongs
  int num_resumed_ = 0;
  bool finished_ = false;
  absl::Status status_;
  mutable Mutex mutex_;
  CondVar cancel_;  // notified when cancelled_ is set
  bool cancelled_ ABSL_GUARDED_BY(mutex_) = false;
  std::unique_ptr<grpc::ClientContext> context_ ABSL_GUARDED_BY(mutex_);
  // Time at which the watchdog cancels the call; infinite while the reader does not read.
  SteadyTime listen_until_ ABSL_GUARDED_BY(mutex_) = SteadyTime::InfiniteFuture();
  std::thread watchdog_;
};

// The methods of StreamCall.
std::unique_ptr<grpc::ClientReader<v1::WatchResponse>> OpenWatch(Connection& connection,
                                                                 grpc::ClientContext* context,
                                                                 const v1::WatchRequest& request) {
  return connection.watch().Watch(context, request);
}

std::unique_ptr<grpc::ClientReader<v1::ReplicateResponse>> OpenReplicate(
    Connection& connection, grpc::ClientContext* context, const v1::ReplicateRequest& request) {
  return connection.watch().Replicate(context, request);
}

// As the generated stubs do it, which know no other type of the answer.
template <typename Request>
std::unique_ptr<grpc::ClientReader<CountedResponse>> OpenCounted(Connection& connection,
                                                                 grpc::ClientContext* context,
                                                                 const Request& request) {
  constexpr bool kIsWatch = std::is_same_v<Request, v1::WatchRequest>;
  const grpc::internal::RpcMethod method(
      kIsWatch ? "/hypermap.v1.WatchService/Watch" : "/hypermap.v1.WatchService/Replicate",
      grpc::internal::RpcMethod::SERVER_STREAMING);
  return std::unique_ptr<grpc::ClientReader<CountedResponse>>(
      grpc::internal::ClientReaderFactory<CountedResponse>::Create(&connection.channel(), method,
                                                                   context, request));
}

using WatchStream = StreamCall<v1::WatchRequest, v1::WatchResponse>;
using CountedWatchStream = StreamCall<v1::WatchRequest, CountedResponse>;
using ReplicateStream = StreamCall<v1::ReplicateRequest, v1::ReplicateResponse>;
using CountedReplicateStream = StreamCall<v1::ReplicateRequest, CountedResponse>;

}  // namespace

Watcher::Watcher(std::unique_ptr<Call> call) : call_(std::move(call)) {}
Watcher::Watcher(Watcher&&) noexcept = default;
Watcher& Watcher::operator=(Watcher&&) noexcept = default;
Watcher::~Watcher() = default;

std::optional<WatchEvent> Watcher::Next() { return call_->Next(); }
const absl::Status& Watcher::status() const { return call_->status(); }
std::optional<Revision> Watcher::revision() const { return call_->revision(); }
uint64_t Watcher::incarnation() const { return call_->incarnation(); }
int Watcher::num_resumed() const { return call_->num_resumed(); }
void Watcher::Cancel() { call_->Cancel(); }

ChangeReader::ChangeReader(std::unique_ptr<PartStream<Part>> source) : source_(std::move(source)) {}

std::optional<MapChange> ChangeReader::Next() {
  while (next_ == part_.changes.size()) {
    std::optional<Part> part = source_->Next();
    if (!part) return std::nullopt;
    part_ = *std::move(part);
    next_ = 0;
  }
  return std::move(part_.changes[next_++]);
}

Watcher Client::Watch(const std::string& map, const WatchOptions& watch_options,
                      const CallOptions& options) {
  const Deadline deadline(options.timeout.value_or(absl::InfiniteDuration()));
  const Breaks breaks{.resume = watch_options.resume,
                      .retry_for = watch_options.retry_for,
                      .idle_timeout = watch_options.idle_timeout,
                      .snapshot_when_compacted = watch_options.snapshot_when_compacted};
  v1::WatchRequest request = EncodeWatch(map, watch_options);
  if (!watch_options.with_changes) {
    return Watcher(std::make_unique<CountedWatchStream>(connection_, &OpenCounted<v1::WatchRequest>,
                                                        std::move(request), breaks, deadline));
  }
  return Watcher(
      std::make_unique<WatchStream>(connection_, &OpenWatch, std::move(request), breaks, deadline));
}

Watcher Client::Replicate(const std::string& map, const ReplicateOptions& replicate_options,
                          const CallOptions& options) {
  const Deadline deadline(options.timeout.value_or(absl::InfiniteDuration()));
  const Breaks breaks{.resume = false,
                      .retry_for = absl::ZeroDuration(),
                      .idle_timeout = replicate_options.idle_timeout};
  v1::ReplicateRequest request = EncodeReplicate(map, replicate_options);
  if (!replicate_options.with_changes) {
    return Watcher(std::make_unique<CountedReplicateStream>(
        connection_, &OpenCounted<v1::ReplicateRequest>, std::move(request), breaks, deadline));
  }
  return Watcher(std::make_unique<ReplicateStream>(connection_, &OpenReplicate, std::move(request),
                                                   breaks, deadline));
}

ChangeReader Client::ListChanges(const std::string& map, Revision from, std::optional<Revision> to,
                                 const Scope& scope, const CallOptions& options) {
  v1::ListChangesRequest request;
  wire::EncodeScope(map, scope, request.mutable_scope());
  request.mutable_scope()->set_incarnation(options.incarnation);
  request.set_from_revision(from);
  if (to) request.set_to_revision(*to);
  return ChangeReader(MakeGrpcPartStream(connection_, connection_->watch(),
                                         &v1::WatchService::Stub::ListChanges, std::move(request),
                                         options, &DecodeDifference));
}

absl::StatusOr<RevisionList> Client::ListRevisions(const std::string& map, const RevisionPage& page,
                                                   const CallOptions& options) {
  v1::ListRevisionsRequest request;
  request.set_map(map);
  request.set_after_revision(page.after);
  request.set_before_revision(page.before);
  request.set_page_size(page.size);
  request.set_newest_first(page.newest_first);
  request.set_incarnation(options.incarnation);
  HYPERMAP_ASSIGN_OR_RETURN(
      const auto response,
      connection_->Call(connection_->watch(), &v1::WatchService::Stub::ListRevisions, request,
                        options));
  return DecodeRevisionList(response);
}

}  // namespace hypermap::client
