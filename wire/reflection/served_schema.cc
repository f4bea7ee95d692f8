#include "wire/reflection/served_schema.h"

#include <google/protobuf/descriptor.pb.h>

#include <cstdint>

#include "absl/container/flat_hash_set.h"
#include "absl/strings/str_cat.h"
#include "base/status/status_macros.h"

namespace hypermap::reflection {
namespace {

using google::protobuf::Descriptor;
using google::protobuf::DescriptorPool;
using google::protobuf::FieldDescriptor;
using google::protobuf::FileDescriptor;

grpc::Slice Encode(const v1::ServerReflectionResponse& response) {
  grpc::Slice slice(response.ByteSizeLong());
  // A slice may be written as long as no other refers to its bytes.
  response.SerializeWithCachedSizesToArray(const_cast<uint8_t*>(slice.begin()));
  return slice;
}

absl::StatusOr<const Descriptor*> FindType(const std::string& name) {
  const Descriptor* const type = DescriptorPool::generated_pool()->FindMessageTypeByName(name);
  if (type == nullptr) return absl::NotFoundError(absl::StrCat("no message type \"", name, "\""));
  return type;
}

absl::StatusOr<const FileDescriptor*> FindFile(const std::string& name) {
  const FileDescriptor* const file = DescriptorPool::generated_pool()->FindFileByName(name);
  if (file == nullptr) return absl::NotFoundError(absl::StrCat("no file \"", name, "\""));
  return file;
}

absl::StatusOr<const FileDescriptor*> FindSymbol(const std::string& name) {
  const FileDescriptor* const file =
      DescriptorPool::generated_pool()->FindFileContainingSymbol(name);
  if (file == nullptr) return absl::NotFoundError(absl::StrCat("no symbol \"", name, "\""));
  return file;
}

absl::StatusOr<const FileDescriptor*> FindExtension(const v1::ExtensionRequest& request) {
  HYPERMAP_ASSIGN_OR_RETURN(const Descriptor* const type, FindType(request.containing_type()));
  const FieldDescriptor* const extension =
      DescriptorPool::generated_pool()->FindExtensionByNumber(type, request.extension_number());
  if (extension == nullptr) {
    return absl::NotFoundError(absl::StrCat("no extension ", request.extension_number(), " of \"",
                                            request.containing_type(), "\""));
  }
  return extension->file();
}

absl::Status ListExtensions(const std::string& name, v1::ExtensionNumberResponse* response) {
  HYPERMAP_ASSIGN_OR_RETURN(const Descriptor* const type, FindType(name));
  std::vector<const FieldDescriptor*> extensions;
  DescriptorPool::generated_pool()->FindAllExtensions(type, &extensions);
  response->set_base_type_name(name);
  for (const FieldDescriptor* extension : extensions) {
    response->add_extension_number(extension->number());
  }
  return absl::OkStatus();
}

// Adds the file, and its imports after it, unless they were added before.
void AddWithImports(const FileDescriptor* file, absl::flat_hash_set<const FileDescriptor*>* added,
                    v1::FileDescriptorResponse* response) {
  if (!added->insert(file).second) return;
  google::protobuf::FileDescriptorProto described;
  file->CopyTo(&described);
  described.SerializeToString(response->add_file_descriptor_proto());
  for (int i = 0; i < file->dependency_count(); ++i) {
    AddWithImports(file->dependency(i), added, response);
  }
}

}  // namespace

grpc::ByteBuffer ServedSchema::Answer(v1::ServerReflectionRequest request) {
  v1::ServerReflectionResponse response;
  const absl::StatusOr<File> file = Find(request, &response);
  if (!file.ok()) {
    response.mutable_error_response()->set_error_code(file.status().raw_code());
    response.mutable_error_response()->set_error_message(std::string(file.status().message()));
  }
  response.set_valid_host(request.host());
  *response.mutable_original_request() = std::move(request);
  const grpc::Slice own = Encode(response);
  if (!file.ok() || *file == nullptr) return grpc::ByteBuffer(&own, 1);
  // The parts of a message may be encoded one after another.
  const grpc::Slice slices[] = {own, EncodedWithImports(*file)};
  return grpc::ByteBuffer(slices, 2);
}

absl::StatusOr<ServedSchema::File> ServedSchema::Find(
    const v1::ServerReflectionRequest& request, v1::ServerReflectionResponse* response) const {
  using Request = v1::ServerReflectionRequest;
  switch (request.message_request_case()) {
    case Request::kFileByFilename:
      return FindFile(request.file_by_filename());
    case Request::kFileContainingSymbol:
      return FindSymbol(request.file_containing_symbol());
    case Request::kFileContainingExtension:
      return FindExtension(request.file_containing_extension());
    case Request::kAllExtensionNumbersOfType:
      HYPERMAP_RETURN_IF_ERROR(ListExtensions(request.all_extension_numbers_of_type(),
                                              response->mutable_all_extension_numbers_response()));
      return nullptr;
    case Request::kListServices:
      ListServices(response->mutable_list_services_response());
      return nullptr;
    case Request::MESSAGE_REQUEST_NOT_SET:
      break;
  }
  return absl::InvalidArgumentError("message_request is missing");
}

void ServedSchema::ListServices(v1::ListServiceResponse* response) const {
  for (const std::string& service : services_) response->add_service()->set_name(service);
}

grpc::Slice ServedSchema::EncodedWithImports(File file) {
  MutexLock lock(&mutex_);
  const auto [entry, is_new] = encoded_.try_emplace(file);
  if (is_new) {
    v1::ServerReflectionResponse response;
    absl::flat_hash_set<File> added;
    AddWithImports(file, &added, response.mutable_file_descriptor_response());
    entry->second = Encode(response);
  }
  return entry->second;
}

}  // namespace hypermap::reflection
