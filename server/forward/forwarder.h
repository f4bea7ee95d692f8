// Passes calls on to the servers that own the maps that they are about.
#ifndef HYPERMAP_SERVER_FORWARD_FORWARDER_H_
#define HYPERMAP_SERVER_FORWARD_FORWARDER_H_

#include <grpcpp/channel.h>
#include <grpcpp/client_context.h>
#include <grpcpp/security/credentials.h>
#include <grpcpp/server_context.h>
#include <grpcpp/support/byte_buffer.h>

#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "absl/base/thread_annotations.h"
#include "absl/functional/function_ref.h"
#include "absl/status/status.h"
#include "absl/strings/string_view.h"
#include "absl/time/time.h"
#include "base/sync/mutex.h"
#include "base/sync/steady_time.h"

namespace hypermap::server {

// Trailing metadata of a call that was passed on to a server that is not the owner either: the
// address of the owner, as far as that server knows.
inline constexpr char kOwnerKey[] = "x-hypermap-owner";
// Trailing metadata of refused calls: after how many milliseconds to try again (gRFC A6).
inline constexpr char kPushbackKey[] = "grpc-retry-pushback-ms";

// A call that is passed on.
struct ForwardedCall {
  // The call's server context, which gives its twin the deadline and ends it when the caller
  // cancels. Lives until the twin has ended.
  const grpc::CallbackServerContext* caller;
  std::string method;  // such as "/hypermap.v1.EditService/ApplyEdits"
  std::string map;
  std::string owner;    // of the map, HOST:PORT, as this server knows it
  std::string address;  // of the server that gets the call: the owner, or whom that one names
  // Values that are not printable ASCII are left out, because headers can't carry them.
  std::vector<std::pair<std::string, std::string>> metadata;
};

// How it has ended.
struct ForwardedEnd {
  absl::Status status;
  std::string pushback_ms;  // kPushbackKey; empty if there was none
  std::string owner;        // kOwnerKey; empty if there was none
};

class Forwarder;

// A call that must be passed on, and who passes it on.
struct Forwarding {
  Forwarder* forwarder;
  ForwardedCall call;
};

// Has connections to other servers, and knows the calls that are under way there. Thread safe.
class Forwarder {
 public:
  // Channels that no call has used for this long are dropped.
  static constexpr absl::Duration kKeepChannel = absl::Minutes(10);

  // The credentials are for all servers. Larger answers are refused with RESOURCE_EXHAUSTED.
  Forwarder(std::shared_ptr<grpc::ChannelCredentials> credentials, int max_message_bytes);

  // Calls a unary method with the encoded request, and then `done`, on a thread of gRPC's or on
  // this one. The buffers live until then. If the server is not the owner, but names another
  // one, that one is called instead, once. Nothing else is tried again.
  void Call(ForwardedCall call, const grpc::ByteBuffer* request, grpc::ByteBuffer* response,
            std::function<void(const ForwardedEnd&)> done);

  // A call that is under way at another server.
  class UnderWay {
   public:
    // Ends the call with this error. Not called before Enter, nor after Leave.
    virtual void Stop(const absl::Status& status) = 0;

   protected:
    ~UnderWay() = default;
  };
  void Enter(UnderWay* call, const ForwardedCall& description);
  void Leave(UnderWay* call);
  // Ends the calls about maps that have another owner by now, with UNAVAILABLE: the former one may
  // be frozen or cut off, and never answer. `owner_of` returns the owner of a map as in
  // ForwardedCall, "" if nobody is known to own it, nullopt if this server does. To be called about
  // every second.
  void EndCallsToFormerOwners(
      absl::FunctionRef<std::optional<std::string>(const std::string& map)> owner_of);

  // The channel for the stream of a call, so that unary calls do not wait for the end of streams
  // when a connection has as many calls as the server admits.
  std::shared_ptr<grpc::Channel> ChannelForStream(const std::string& address) {
    return ChannelTo("stream", address);
  }

  // The context of a call's twin.
  static std::unique_ptr<grpc::ClientContext> ContextOf(const ForwardedCall& call);
  // The end of a call's twin.
  static ForwardedEnd EndOf(const ForwardedCall& call, const grpc::Status& status,
                            const grpc::ClientContext& context);

 private:
  using ChannelKey = std::pair<std::string, std::string>;  // kind, address
  struct UsedChannel {
    std::shared_ptr<grpc::Channel> channel;
    SteadyTime used;
  };
  struct Place {
    std::string map;
    std::string owner;
    std::string address;
    bool replaces_map = false;
  };
  class Attempt;

  void Start(const std::shared_ptr<Attempt>& attempt);
  void Ended(const std::shared_ptr<Attempt>& attempt, const grpc::Status& status);
  std::shared_ptr<grpc::Channel> ChannelTo(absl::string_view kind, const std::string& address);

  const std::shared_ptr<grpc::ChannelCredentials> credentials_;
  const int max_message_bytes_;
  Mutex mutex_;
  std::map<ChannelKey, UsedChannel> channels_ ABSL_GUARDED_BY(mutex_);
  Mutex calls_mutex_;
  std::map<UnderWay*, Place> calls_ ABSL_GUARDED_BY(calls_mutex_);
};

}  // namespace hypermap::server

#endif  // HYPERMAP_SERVER_FORWARD_FORWARDER_H_
