#include "server/forward/forwarder.h"

#include <grpcpp/create_channel.h>
#include <grpcpp/generic/generic_stub.h>

#include <algorithm>

#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"
#include "server/auth/metadata.h"
#include "wire/status.h"

namespace hypermap::server {
namespace {

// Another server is near: an attempt to connect that takes longer is not worth the wait.
constexpr int kConnectTimeout_ms = 2'000;
constexpr int kFirstReconnect_ms = 50;
constexpr int kLastReconnect_ms = 1'000;
// A connection whose bytes are not acknowledged for this long is closed (TCP_USER_TIMEOUT): the
// machine of the other server is gone, and nobody tells. gRPC sets it only together with pings,
// which must not come more often than servers tolerate without traffic, every five minutes.
constexpr int kUnacknowledged_ms = 10'000;
constexpr int kPing_ms = 310'000;

grpc::ChannelArguments Arguments(int max_message_bytes) {
  grpc::ChannelArguments arguments;
  arguments.SetMaxReceiveMessageSize(max_message_bytes);
  arguments.SetInt(GRPC_ARG_ENABLE_HTTP_PROXY, 0);
  arguments.SetInt(GRPC_ARG_USE_LOCAL_SUBCHANNEL_POOL, 1);
  arguments.SetInt(GRPC_ARG_MIN_RECONNECT_BACKOFF_MS, kConnectTimeout_ms);
  arguments.SetInt(GRPC_ARG_INITIAL_RECONNECT_BACKOFF_MS, kFirstReconnect_ms);
  arguments.SetInt(GRPC_ARG_MAX_RECONNECT_BACKOFF_MS, kLastReconnect_ms);
  arguments.SetInt(GRPC_ARG_KEEPALIVE_TIME_MS, kPing_ms);
  arguments.SetInt(GRPC_ARG_KEEPALIVE_TIMEOUT_MS, kUnacknowledged_ms);
  return arguments;
}

std::string TrailingOf(const grpc::ClientContext& context, const char* key) {
  const auto& metadata = context.GetServerTrailingMetadata();
  const auto found = metadata.find(key);
  return found == metadata.end() ? "" : std::string(found->second.data(), found->second.size());
}

// Returns whether a header can carry the value; gRPC ends the process for others.
bool IsPrintable(absl::string_view value) {
  return std::all_of(value.begin(), value.end(), [](char c) { return ' ' <= c && c <= '~'; });
}

}  // namespace

// A unary call to one server.
class Forwarder::Attempt final : public UnderWay {
 public:
  using Done = std::function<void(const ForwardedEnd&)>;

  Attempt(ForwardedCall call, const grpc::ByteBuffer* request, grpc::ByteBuffer* response,
          Done done)
      : call_(std::move(call)),
        request_(request),
        response_(response),
        done_(std::move(done)),
        context_(ContextOf(call_)) {}

  const ForwardedCall& call() const { return call_; }
  void Start(std::shared_ptr<grpc::Channel> channel,
             std::function<void(const grpc::Status&)> ended) {
    channel_ = std::move(channel);
    grpc::GenericStub(channel_).UnaryCall(context_.get(), call_.method, {}, request_, response_,
                                          std::move(ended));
  }
  void Stop(const absl::Status& status) override {
    {
      const MutexLock lock(&mutex_);
      stopped_ = status;
    }
    context_->TryCancel();
  }
  ForwardedEnd End(const grpc::Status& status) {
    const MutexLock lock(&mutex_);
    return stopped_.ok() ? EndOf(call_, status, *context_) : ForwardedEnd{stopped_, "", ""};
  }
  void Tell(const ForwardedEnd& end) { done_(end); }
  // The same call to the server that this one has named as the owner; null if this call was made so
  // itself. Nothing of the call was carried out. Tell must not be called then.
  std::shared_ptr<Attempt> Follow(const std::string& hint) {
    if (call_.address != call_.owner) return nullptr;
    ForwardedCall next = call_;
    next.address = hint;
    return std::make_shared<Attempt>(std::move(next), request_, response_, std::move(done_));
  }

 private:
  const ForwardedCall call_;
  const grpc::ByteBuffer* const request_;
  grpc::ByteBuffer* const response_;
  Done done_;
  std::shared_ptr<grpc::Channel> channel_;
  const std::unique_ptr<grpc::ClientContext> context_;
  Mutex mutex_;
  absl::Status stopped_ ABSL_GUARDED_BY(mutex_);
};

Forwarder::Forwarder(std::shared_ptr<grpc::ChannelCredentials> credentials, int max_message_bytes)
    : credentials_(std::move(credentials)), max_message_bytes_(max_message_bytes) {}

void Forwarder::Call(ForwardedCall call, const grpc::ByteBuffer* request,
                     grpc::ByteBuffer* response, std::function<void(const ForwardedEnd&)> done) {
  Start(std::make_shared<Attempt>(std::move(call), request, response, std::move(done)));
}

void Forwarder::Start(const std::shared_ptr<Attempt>& attempt) {
  Enter(attempt.get(), attempt->call());
  attempt->Start(ChannelTo("unary", attempt->call().address),
                 [this, attempt](const grpc::Status& status) { Ended(attempt, status); });
}

void Forwarder::Ended(const std::shared_ptr<Attempt>& attempt, const grpc::Status& status) {
  Leave(attempt.get());
  const ForwardedEnd end = attempt->End(status);
  if (!end.owner.empty()) {
    if (const std::shared_ptr<Attempt> next = attempt->Follow(end.owner)) return Start(next);
  }
  attempt->Tell(end);
}

void Forwarder::Enter(UnderWay* call, const ForwardedCall& description) {
  const MutexLock lock(&calls_mutex_);
  calls_.emplace(call, Place{description.map, description.owner, description.address,
                             absl::EndsWith(description.method, "/RestoreMap")});
}

void Forwarder::Leave(UnderWay* call) {
  const MutexLock lock(&calls_mutex_);
  calls_.erase(call);
}

void Forwarder::EndCallsToFormerOwners(
    absl::FunctionRef<std::optional<std::string>(const std::string& map)> owner_of) {
  // While the lock is held no call is deleted, because Leave waits for it.
  const MutexLock lock(&calls_mutex_);
  for (const auto& [call, place] : calls_) {
    const std::optional<std::string> owner = owner_of(place.map);
    // A server that the owner has named may be the owner although this server does not know yet.
    if (owner == place.owner || owner == place.address) continue;
    // Nobody owns what was restored until its server opens it.
    if (place.replaces_map && owner == "") continue;
    call->Stop(absl::UnavailableError(absl::StrCat("map \"", place.map,
                                                   "\" is no longer owned by the server at ",
                                                   place.address, ", which has not answered")));
  }
}

std::shared_ptr<grpc::Channel> Forwarder::ChannelTo(absl::string_view kind,
                                                    const std::string& address) {
  const SteadyTime now = SteadyTime::Now();
  const MutexLock lock(&mutex_);
  // Calls that are under way keep their channel.
  std::erase_if(channels_, [&](const auto& entry) {
    return entry.first.second != address && now - entry.second.used > kKeepChannel;
  });
  const ChannelKey key(kind, address);
  UsedChannel& entry = channels_.try_emplace(key, UsedChannel{nullptr, now}).first->second;
  entry.used = now;
  if (!entry.channel) {
    entry.channel = grpc::CreateCustomChannel(address, credentials_, Arguments(max_message_bytes_));
  }
  return entry.channel;
}

std::unique_ptr<grpc::ClientContext> Forwarder::ContextOf(const ForwardedCall& call) {
  std::unique_ptr<grpc::ClientContext> context =
      grpc::ClientContext::FromCallbackServerContext(*call.caller);
  for (const auto& [key, value] : call.metadata) {
    if (IsPrintable(value)) context->AddMetadata(key, value);
  }
  context->AddMetadata(kForwardedKey, "1");
  return context;
}

ForwardedEnd Forwarder::EndOf(const ForwardedCall& call, const grpc::Status& status,
                              const grpc::ClientContext& context) {
  ForwardedEnd end{wire::DecodeStatus(status), TrailingOf(context, kPushbackKey),
                   TrailingOf(context, kOwnerKey)};
  if (absl::IsUnavailable(end.status)) {
    end.status = absl::UnavailableError(absl::StrCat("the owner of the map, the server at ",
                                                     call.address, ": ", end.status.message()));
  }
  return end;
}

}  // namespace hypermap::server
