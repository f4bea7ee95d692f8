#include "server/rpc/request_digest.h"

#include <google/protobuf/descriptor.h>
#include <google/protobuf/io/coded_stream.h>
#include <google/protobuf/io/zero_copy_stream_impl_lite.h>
#include <google/protobuf/text_format.h>

#include <cstddef>
#include <cstdint>
#include <vector>

#include "absl/strings/str_cat.h"

namespace hypermap::server {
namespace {

namespace protobuf = google::protobuf;

constexpr size_t kDigestBytes = 16;

class DigestStream final : public protobuf::io::CopyingOutputStream {
 public:
  explicit DigestStream(Sha256* digest) : digest_(digest) {}

  bool Write(const void* buffer, int size) override {
    digest_->Add({static_cast<const char*>(buffer), static_cast<size_t>(size)});
    return true;
  }

 private:
  Sha256* const digest_;
};

// Writes one value of a field. `index` is -1 if the field is not repeated.
void WriteValue(const protobuf::Message& message, const protobuf::FieldDescriptor& field, int index,
                protobuf::io::CodedOutputStream* out) {
  if (field.cpp_type() == protobuf::FieldDescriptor::CPPTYPE_MESSAGE) {
    const protobuf::Reflection& reflection = *message.GetReflection();
    const protobuf::Message& value = index < 0
                                         ? reflection.GetMessage(message, &field)
                                         : reflection.GetRepeatedMessage(message, &field, index);
    out->WriteVarint64(value.ByteSizeLong());
    value.SerializeWithCachedSizes(out);
    return;
  }
  std::string text;
  protobuf::TextFormat::PrintFieldValueToString(message, &field, index, &text);
  out->WriteVarint64(text.size());
  out->WriteString(text);
}

void WriteFields(const protobuf::Message& message, protobuf::io::CodedOutputStream* out) {
  const protobuf::Reflection& reflection = *message.GetReflection();
  std::vector<const protobuf::FieldDescriptor*> fields;
  reflection.ListFields(message, &fields);
  for (const protobuf::FieldDescriptor* field : fields) {
    if (field->name() == "request_id" || field->name() == "incarnation") continue;
    out->WriteVarint64(static_cast<uint64_t>(field->number()));
    if (!field->is_repeated()) {
      WriteValue(message, *field, -1, out);
      continue;
    }
    const int size = reflection.FieldSize(message, field);
    out->WriteVarint64(static_cast<uint64_t>(size));
    for (int i = 0; i < size; ++i) WriteValue(message, *field, i, out);
  }
}

}  // namespace

RequestDigest::RequestDigest(const protobuf::Message& message) {
  AddSized(message.GetDescriptor()->full_name());
  DigestStream stream(&digest_);
  protobuf::io::CopyingOutputStreamAdaptor buffered(&stream);
  protobuf::io::CodedOutputStream out(&buffered);
  out.SetSerializationDeterministic(true);
  WriteFields(message, &out);
}

void RequestDigest::AddSized(absl::string_view bytes) {
  digest_.Add(absl::StrCat(bytes.size(), ":"));
  digest_.Add(bytes);
}

void RequestDigest::AddPiece(absl::string_view file_name, absl::string_view piece) {
  if (!file_ || file_->name != file_name) {
    EndFile();
    file_.emplace(File{std::string(file_name), Sha256()});
  }
  file_->content.Add(piece);
}

void RequestDigest::EndFile() {
  if (!file_) return;
  AddSized(file_->name);
  AddSized(std::move(file_->content).Finish());
  file_.reset();
}

std::string RequestDigest::Finish() && {
  EndFile();
  std::string digest = std::move(digest_).Finish();
  digest.resize(kDigestBytes);
  return digest;
}

}  // namespace hypermap::server
