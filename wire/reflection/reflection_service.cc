#include "wire/reflection/reflection_service.h"

#include <utility>

#include "grpc/reflection/v1/reflection.grpc.pb.h"
#include "grpc/reflection/v1alpha/reflection.grpc.pb.h"
#include "wire/reflection/reflection_call.h"
#include "wire/reflection/served_schema.h"

namespace hypermap::reflection {
namespace {

namespace v1alpha = grpc::reflection::v1alpha;

using BidiReactor = grpc::ServerBidiReactor<grpc::ByteBuffer, grpc::ByteBuffer>;

// One version of the service. The messages of all versions have the same encoding.
template <typename Version>
class Service final : public Version::template WithRawCallbackMethod_ServerReflectionInfo<
                          typename Version::Service> {
 public:
  using NewCall = std::function<BidiReactor*(grpc::CallbackServerContext*)>;

  explicit Service(NewCall new_call) : new_call_(std::move(new_call)) {}

  BidiReactor* ServerReflectionInfo(grpc::CallbackServerContext* context) override {
    return new_call_(context);
  }

 private:
  const NewCall new_call_;
};

std::vector<std::string> WithReflection(std::vector<std::string> services) {
  services.emplace_back(v1::ServerReflection::service_full_name());
  services.emplace_back(v1alpha::ServerReflection::service_full_name());
  return services;
}

}  // namespace

struct ReflectionService::Impl {
  Impl(std::vector<std::string> services, Admit admit)
      : schema(WithReflection(std::move(services))), admit(std::move(admit)) {}

  BidiReactor* NewCall(grpc::CallbackServerContext* context) {
    return new ReflectionCall(context, admit(context), &schema, &calls);
  }

  ServedSchema schema;
  const Admit admit;
  OpenReflectionCalls calls;
  Service<v1::ServerReflection> stable{[this](auto* context) { return NewCall(context); }};
  Service<v1alpha::ServerReflection> alpha{[this](auto* context) { return NewCall(context); }};
};

ReflectionService::ReflectionService(std::vector<std::string> services, Admit admit)
    : impl_(std::make_unique<Impl>(std::move(services), std::move(admit))) {
  // A file is found only if it is linked into the program, which this reference ensures.
  v1alpha::ServerReflectionRequest::descriptor();
}

ReflectionService::~ReflectionService() = default;

void ReflectionService::RegisterWith(grpc::ServerBuilder* builder) {
  builder->RegisterService(&impl_->stable);
  builder->RegisterService(&impl_->alpha);
}

void ReflectionService::Stop() { impl_->calls.Stop(); }

}  // namespace hypermap::reflection
