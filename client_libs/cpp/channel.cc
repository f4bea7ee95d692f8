#include "client_libs/cpp/channel.h"

#include <arpa/inet.h>
#include <grpcpp/create_channel.h>
#include <grpcpp/security/credentials.h>
#include <grpcpp/support/client_interceptor.h>
#include <netinet/in.h>

#include <algorithm>
#include <utility>
#include <vector>

#include "absl/strings/ascii.h"
#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_split.h"
#include "absl/strings/strip.h"
#include "absl/time/clock.h"
#include "base/sync/deadline.h"
#include "base/tls/channel_credentials.h"
#include "wire/status.h"

namespace hypermap::client {
namespace {

using grpc::experimental::InterceptionHookPoints;

// Characters that RFC 6750 allows in a token and that a header can carry.
bool IsTokenCharacter(char c) { return c > ' ' && c < '\x7f'; }

absl::StatusOr<std::string> AskToken(const TokenSource& source) {
  absl::StatusOr<std::string> token = source();
  if (!token.ok()) return token;
  if (token->empty()) return absl::InvalidArgumentError("the token is empty");
  if (!std::all_of(token->begin(), token->end(), IsTokenCharacter)) {
    return absl::InvalidArgumentError("the token has characters that can't be sent");
  }
  return token;
}

// Sends a token with one call. If there is no token, the call ends with the reason and nothing is
// sent.
class BearerToken : public grpc::experimental::Interceptor {
 public:
  explicit BearerToken(const TokenSource& source) : source_(source) {}

  void Intercept(grpc::experimental::InterceptorBatchMethods* methods) override {
    bool hijack = false;
    if (methods->QueryInterceptionHookPoint(InterceptionHookPoints::PRE_SEND_INITIAL_METADATA)) {
      const absl::StatusOr<std::string> token = AskToken(source_);
      if (token.ok()) {
        methods->GetSendInitialMetadata()->emplace("authorization",
                                                   absl::StrCat("Bearer ", *token));
      } else {
        // Always the same code, so that callers do not take the error for an answer of the server.
        problem_ = absl::UnauthenticatedError(token.status().message());
        hijack = true;
      }
    }
    if (!problem_.ok()) Fail(methods);
    if (hijack) {
      methods->Hijack();
    } else {
      methods->Proceed();
    }
  }

 private:
  // Fails every operation of a hijacked call, since gRPC still passes all of them to this
  // interceptor.
  void Fail(grpc::experimental::InterceptorBatchMethods* methods) {
    if (methods->QueryInterceptionHookPoint(InterceptionHookPoints::PRE_SEND_MESSAGE)) {
      methods->FailHijackedSendMessage();
    }
    if (methods->QueryInterceptionHookPoint(InterceptionHookPoints::PRE_RECV_MESSAGE)) {
      methods->FailHijackedRecvMessage();
    }
    if (methods->QueryInterceptionHookPoint(InterceptionHookPoints::PRE_RECV_STATUS)) {
      *methods->GetRecvStatus() = wire::EncodeStatus(problem_);
    }
  }

  const TokenSource& source_;
  absl::Status problem_;
};

// Owned by the channel, and lives as long as it.
class BearerTokens : public grpc::experimental::ClientInterceptorFactoryInterface {
 public:
  explicit BearerTokens(TokenSource source) : source_(std::move(source)) {}

  grpc::experimental::Interceptor* CreateClientInterceptor(
      grpc::experimental::ClientRpcInfo* /*info*/) override {
    return new BearerToken(source_);  // the call owns it
  }

 private:
  const TokenSource source_;
};

// Returns whether data sent to the target stays on this machine.
bool IsLoopback(const std::string& target) {
  if (absl::StartsWith(target, "unix:")) return true;
  absl::string_view host = target;
  if (!absl::ConsumePrefix(&host, "dns:///") && !absl::ConsumePrefix(&host, "ipv4:")) {
    absl::ConsumePrefix(&host, "ipv6:");
  }
  host = host.substr(0, host.rfind(':'));
  if (host == "localhost") return true;
  if (absl::ConsumePrefix(&host, "[")) absl::ConsumeSuffix(&host, "]");
  const std::string address(host);
  in_addr v4;
  if (inet_pton(AF_INET, address.c_str(), &v4) == 1) return ntohl(v4.s_addr) >> 24 == 127;
  in6_addr v6;
  return inet_pton(AF_INET6, address.c_str(), &v6) == 1 && IN6_IS_ADDR_LOOPBACK(&v6);
}

// Returns an error if no call can be made with these options.
absl::Status Check(const std::string& target, const ClientOptions& options) {
  if (options.tls) return CheckTls(*options.tls);
  if (options.token && !options.token_in_clear && !IsLoopback(target)) {
    return absl::FailedPreconditionError(absl::StrCat("a token is not sent to ", target,
                                                      " without TLS, where others could read it"));
  }
  return absl::OkStatus();
}

// REQUIRES: CheckTls(tls) is OK.
std::shared_ptr<grpc::ChannelCredentials> CredentialsOf(const TlsOptions& tls) {
  return hypermap::tls::MakeChannelCredentials(
      {tls.root_certificates, tls.certificate_chain, tls.private_key});
}

// Lets calls fail soon if nothing comes back from the other machine, since another server may
// answer them.
void LeaveDeadMachines(grpc::ChannelArguments& arguments) {
  // Longer than TCP waits to repeat a lost packet for the second time.
  arguments.SetInt(GRPC_ARG_MIN_RECONNECT_BACKOFF_MS, 5'000);
  // While there are calls, pings that the server takes every 5 s.
  arguments.SetInt(GRPC_ARG_KEEPALIVE_TIME_MS, 10'000);
  arguments.SetInt(GRPC_ARG_KEEPALIVE_TIMEOUT_MS, 10'000);
  arguments.SetInt(GRPC_ARG_HTTP2_MAX_PINGS_WITHOUT_DATA, 0);
}

// `is_only`: the channel goes to the only server.
grpc::ChannelArguments ArgumentsOf(const ClientOptions& options, bool is_only) {
  grpc::ChannelArguments arguments;
  // The server limits the size of answers, so the client does not.
  arguments.SetMaxReceiveMessageSize(-1);
  arguments.SetInt(GRPC_ARG_ENABLE_HTTP_PROXY, 0);
  // gRPC reconnects eagerly, so that a server that is back is found soon. Backoff limits the
  // retries.
  arguments.SetInt(GRPC_ARG_INITIAL_RECONNECT_BACKOFF_MS, 50);
  arguments.SetInt(GRPC_ARG_MAX_RECONNECT_BACKOFF_MS, 1000);
  // The time that an attempt to connect may take, handshakes included: long enough for a slow link,
  // and shorter than the default of 20 s, because TCP repeats what was lost after 1, 3, 7 and 15 s:
  // a robot that is back in range would wait.
  arguments.SetInt(GRPC_ARG_MIN_RECONNECT_BACKOFF_MS, 10'000);
  if (!is_only) LeaveDeadMachines(arguments);
  if (options.own_connection) arguments.SetInt(GRPC_ARG_USE_LOCAL_SUBCHANNEL_POOL, 1);
  if (options.tls && !options.tls->server_name.empty()) {
    arguments.SetSslTargetNameOverride(options.tls->server_name);
  }
  return arguments;
}

// `problem` is the error with which each call fails.
std::shared_ptr<grpc::Channel> MakeChannel(const std::string& target, const ClientOptions& options,
                                           const absl::Status& problem, bool is_only) {
  TokenSource token = options.token;
  if (!problem.ok()) token = [problem] { return absl::StatusOr<std::string>(problem); };
  std::vector<std::unique_ptr<grpc::experimental::ClientInterceptorFactoryInterface>> interceptors;
  if (token) interceptors.push_back(std::make_unique<BearerTokens>(std::move(token)));
  return grpc::experimental::CreateCustomChannelWithInterceptors(
      target,
      options.tls && problem.ok() ? CredentialsOf(*options.tls)
                                  : grpc::InsecureChannelCredentials(),
      ArgumentsOf(options, is_only), std::move(interceptors));
}

}  // namespace

gpr_timespec GrpcTime(const Deadline& deadline) {
  const absl::Duration left = deadline.left();
  if (left == absl::InfiniteDuration()) return gpr_inf_future(GPR_CLOCK_MONOTONIC);
  return gpr_time_add(gpr_now(GPR_CLOCK_MONOTONIC),
                      gpr_time_from_micros(absl::ToInt64Microseconds(left), GPR_TIMESPAN));
}

void Pause(grpc::Channel& channel, absl::Duration duration, absl::FunctionRef<bool()> given_up) {
  constexpr absl::Duration kLook = absl::Milliseconds(50);
  const Deadline end(duration);
  // If the channel is connected and the call still failed, the whole pause is waited:
  // WaitForConnected would return at once.
  const bool was_ready = channel.GetState(/*try_to_connect=*/true) == GRPC_CHANNEL_READY;
  while (!end.has_passed() && !given_up()) {
    const absl::Duration until_look = std::min(end.left(), kLook);
    if (was_ready) {
      absl::SleepFor(until_look);
    } else if (channel.WaitForConnected(GrpcTime(Deadline(until_look)))) {
      return;
    }
  }
}

std::vector<std::shared_ptr<grpc::Channel>> MakeChannels(const std::string& targets,
                                                         const ClientOptions& options) {
  std::vector<std::string> each = absl::StrSplit(targets, ',', absl::SkipWhitespace());
  if (each.empty()) each.emplace_back();
  absl::Status problem;
  for (std::string& target : each) {
    absl::StripAsciiWhitespace(&target);
    problem.Update(Check(target, options));
  }
  std::vector<std::shared_ptr<grpc::Channel>> channels;
  channels.reserve(each.size());
  for (const std::string& target : each) {
    channels.push_back(MakeChannel(target, options, problem, /*is_only=*/each.size() == 1));
  }
  return channels;
}

}  // namespace hypermap::client
