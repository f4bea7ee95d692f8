#include "wire/health/health_service.h"

#include <grpcpp/server_context.h>
#include <grpcpp/support/byte_buffer.h>
#include <grpcpp/support/server_callback.h>

#include <utility>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "base/status/status_macros.h"
#include "grpc/health/v1/health.grpc.pb.h"
#include "wire/health/messages.h"
#include "wire/health/statuses.h"
#include "wire/health/watch_call.h"

namespace hypermap::health {
namespace {

using grpc::health::v1::Health;
using reflection::Admit;
using reflection::Ticket;

// Fills the response.
absl::Status Answer(const Ticket& ticket, const Statuses& statuses, grpc::ByteBuffer* request,
                    grpc::ByteBuffer* response) {
  HYPERMAP_ASSIGN_OR_RETURN(const std::string service, TakeServiceName(ticket, request));
  const ServingStatus status = statuses.Find(service);
  if (status == HealthCheckResponse::SERVICE_UNKNOWN) {
    return absl::NotFoundError("the service is unknown");
  }
  Encode(status).Swap(response);
  return absl::OkStatus();
}

// A Check rpc, which is answered at once and admitted until gRPC has sent the answer.
class CheckCall final : public grpc::ServerUnaryReactor {
 public:
  CheckCall(std::unique_ptr<Ticket> ticket, const Statuses& statuses, grpc::ByteBuffer* request,
            grpc::ByteBuffer* response)
      : ticket_(std::move(ticket)) {
    Finish(ticket_->Encode(Answer(*ticket_, statuses, request, response)));
  }

  void OnDone() override { delete this; }
  bool InternalInlineable() override { return true; }

 private:
  const std::unique_ptr<Ticket> ticket_;
};

using RawService =
    Health::WithRawCallbackMethod_Check<Health::WithRawCallbackMethod_Watch<Health::Service>>;

class Service final : public RawService {
 public:
  Service(Statuses* statuses, Admit admit) : statuses_(*statuses), admit_(std::move(admit)) {}

  grpc::ServerUnaryReactor* Check(grpc::CallbackServerContext* context,
                                  const grpc::ByteBuffer* request,
                                  grpc::ByteBuffer* response) override {
    return new CheckCall(admit_(context), statuses_, Own(request), response);
  }

  grpc::ServerWriteReactor<grpc::ByteBuffer>* Watch(grpc::CallbackServerContext* context,
                                                    const grpc::ByteBuffer* request) override {
    std::unique_ptr<Ticket> ticket = admit_(context);
    const absl::StatusOr<std::string> service = TakeServiceName(*ticket, Own(request));
    return WatchCall::Start(std::move(ticket), service, &statuses_);
  }

 private:
  // gRPC keeps a request until its call ends, but does not read it. The bytes share a buffer of
  // some KiB with others that were received at the same time.
  static grpc::ByteBuffer* Own(const grpc::ByteBuffer* request) {
    return const_cast<grpc::ByteBuffer*>(request);
  }

  Statuses& statuses_;
  const Admit admit_;
};

}  // namespace

struct HealthService::Impl {
  explicit Impl(Admit admit) : service(&statuses, std::move(admit)) {}

  Statuses statuses;
  Service service;
};

HealthService::HealthService(Admit admit) : impl_(std::make_unique<Impl>(std::move(admit))) {}

HealthService::~HealthService() = default;

void HealthService::RegisterWith(grpc::ServerBuilder* builder) {
  builder->RegisterService(&impl_->service);
}

void HealthService::SetServingStatus(const std::string& service, bool serving) {
  impl_->statuses.Set(service, serving);
}

void HealthService::Forget(const std::string& service) { impl_->statuses.Forget(service); }

void HealthService::Stop() { impl_->statuses.Stop(); }

}  // namespace hypermap::health
