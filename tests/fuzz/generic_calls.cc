#include "tests/fuzz/generic_calls.h"

#include <grpcpp/client_context.h>
#include <grpcpp/completion_queue.h>
#include <grpcpp/support/byte_buffer.h>

#include <chrono>
#include <string>

#include "tests/fuzz/require.h"

namespace hypermap::fuzz {
namespace {

using google::protobuf::Descriptor;
using google::protobuf::FieldDescriptor;
using google::protobuf::Message;
using google::protobuf::MethodDescriptor;

// Calls that wait for a revision end after this time.
constexpr std::chrono::milliseconds kDeadline(500);
// A watch that is silent for this long has told all there was.
constexpr std::chrono::milliseconds kSilence(20);
constexpr int kMaxAnswers = 20;

// All rpcs by their request, which no two have in common.
std::map<const Descriptor*, const MethodDescriptor*> AllMethods() {
  std::map<const Descriptor*, const MethodDescriptor*> methods;
  const google::protobuf::FileDescriptor* const file = Calls::descriptor()->file();
  for (int i = 0; i < file->dependency_count(); ++i) {
    for (int s = 0; s < file->dependency(i)->service_count(); ++s) {
      const google::protobuf::ServiceDescriptor* const service = file->dependency(i)->service(s);
      for (int m = 0; m < service->method_count(); ++m) {
        methods[service->method(m)->input_type()] = service->method(m);
      }
    }
  }
  return methods;
}

const MethodDescriptor* MethodOf(const Descriptor* request) {
  static const auto& methods =
      *new std::map<const Descriptor*, const MethodDescriptor*>(AllMethods());
  const auto it = methods.find(request);
  return it == methods.end() ? nullptr : it->second;
}

// The request that is set; null if none is.
const Message* RequestOf(const Call& call) {
  const FieldDescriptor* const field =
      call.GetReflection()->GetOneofFieldDescriptor(call, Call::descriptor()->oneof_decl(0));
  return field == nullptr ? nullptr : &call.GetReflection()->GetMessage(call, field);
}

grpc::ByteBuffer BytesOf(const Message& message) {
  const std::string bytes = message.SerializeAsString();
  const grpc::Slice slice(bytes);
  return {&slice, 1};
}

// Waits for the operation that was begun last. Returns whether it succeeded.
bool Await(grpc::CompletionQueue& queue) {
  void* tag = nullptr;
  bool ok = false;
  REQUIRE(queue.Next(&tag, &ok));
  return ok;
}

// The same, but gives up after kSilence.
bool AwaitOrCancel(grpc::CompletionQueue& queue, grpc::ClientContext& context, bool& cancelled) {
  void* tag = nullptr;
  bool ok = false;
  const auto until = std::chrono::system_clock::now() + kSilence;
  if (queue.AsyncNext(&tag, &ok, until) == grpc::CompletionQueue::GOT_EVENT) return ok;
  context.TryCancel();
  cancelled = true;
  return Await(queue);
}

}  // namespace

const MethodDescriptor* MethodOf(const Call& call) {
  const Message* const request = RequestOf(call);
  if (request == nullptr) return nullptr;
  const MethodDescriptor* const method = MethodOf(request->GetDescriptor());
  // A list of the messages of a stream.
  return method != nullptr ? method : MethodOf(request->GetDescriptor()->field(0)->message_type());
}

grpc::Status GenericCalls::Make(const Call& call) {
  const MethodDescriptor* const method = MethodOf(call);
  if (method == nullptr) return grpc::Status::OK;
  const Message* const request = RequestOf(call);
  if (!method->client_streaming()) return Run(*method, {request});
  Messages messages;
  const FieldDescriptor* const field = request->GetDescriptor()->field(0);
  for (int i = 0; i < request->GetReflection()->FieldSize(*request, field); ++i) {
    messages.push_back(&request->GetReflection()->GetRepeatedMessage(*request, field, i));
  }
  return Run(*method, messages);
}

grpc::Status GenericCalls::Run(const MethodDescriptor& method, const Messages& messages) {
  grpc::CompletionQueue queue;
  grpc::ClientContext context;
  context.set_deadline(std::chrono::system_clock::now() + kDeadline);
  const std::string path = "/" + method.service()->full_name() + "/" + method.name();
  const auto stream = stub_.PrepareCall(&context, path, &queue);
  stream->StartCall(nullptr);
  bool open = Await(queue);
  for (size_t i = 0; open && i < messages.size(); ++i) {
    stream->Write(BytesOf(*messages[i]), nullptr);
    open = Await(queue);
  }
  if (open) {
    stream->WritesDone(nullptr);
    Await(queue);
  }
  bool cancelled = false;
  for (int i = 0; i < kMaxAnswers; ++i) {
    grpc::ByteBuffer answer;
    stream->Read(&answer, nullptr);
    // Only watches may be silent. Other calls end by themselves.
    const bool may_be_silent = method.server_streaming() && !method.client_streaming();
    if (!(may_be_silent ? AwaitOrCancel(queue, context, cancelled) : Await(queue))) break;
    if (i + 1 == kMaxAnswers) {
      context.TryCancel();
      cancelled = true;
    }
  }
  grpc::Status status;
  stream->Finish(&status, nullptr);
  Await(queue);
  queue.Shutdown();
  return cancelled && status.error_code() == grpc::StatusCode::CANCELLED ? grpc::Status::OK
                                                                         : status;
}

}  // namespace hypermap::fuzz
