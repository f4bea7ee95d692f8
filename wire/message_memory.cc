#include "wire/message_memory.h"

#include <google/protobuf/descriptor.h>
#include <google/protobuf/io/coded_stream.h>
#include <google/protobuf/unknown_field_set.h>
#include <google/protobuf/wire_format_lite.h>
#include <grpcpp/support/proto_buffer_reader.h>

#include <algorithm>
#include <memory>
#include <string>
#include <vector>

#include "absl/base/thread_annotations.h"
#include "absl/container/flat_hash_map.h"
#include "base/sync/mutex.h"

namespace hypermap::wire {
namespace {

namespace protobuf = google::protobuf;
using protobuf::internal::WireFormatLite;
using protobuf::io::CodedInputStream;

// Arrays grow by doubling.
constexpr int64_t kGrowth = 2;
constexpr int64_t kPointerBytes = kGrowth * sizeof(void*);
// A std::string keeps up to 15 bytes in itself.
constexpr int64_t kStringBytes = sizeof(std::string);
constexpr int kBytesInString = 15;
// An element of protobuf::UnknownFieldSet.
constexpr int64_t kUnknownBytes = kGrowth * 16;
// A node of protobuf::Map, with its key and value.
constexpr int64_t kMapNodeBytes = 128;
// Fields with larger numbers count as unknown ones.
constexpr int kMaxFieldNumber = 1024;
// Protobuf parses no message that is nested deeper.
constexpr int kMaxDepth = 100;

struct MessageShape;

struct FieldShape {
  enum class Kind { kUnknown, kNumber, kString, kMessage };

  Kind kind = Kind::kUnknown;
  bool is_repeated = false;
  bool is_varint = false;                 // of numbers: how they are encoded in packed arrays
  int64_t number_bytes = 0;               // of numbers
  const MessageShape* message = nullptr;  // of messages
};

struct MessageShape {
  int64_t bytes = 0;
  std::vector<FieldShape> fields;  // by number
};

int64_t BytesOf(protobuf::FieldDescriptor::CppType type) {
  switch (type) {
    case protobuf::FieldDescriptor::CPPTYPE_BOOL:
      return 1;
    case protobuf::FieldDescriptor::CPPTYPE_INT32:
    case protobuf::FieldDescriptor::CPPTYPE_UINT32:
    case protobuf::FieldDescriptor::CPPTYPE_FLOAT:
    case protobuf::FieldDescriptor::CPPTYPE_ENUM:
      return 4;
    default:
      return 8;
  }
}

// The shapes of all types of messages that were asked for. Thread safe.
class Shapes {
 public:
  // The shape lives as long as the process.
  const MessageShape* Of(const protobuf::Descriptor* type) {
    const MutexLock lock(&mutex_);
    return Find(type);
  }

 private:
  const MessageShape* Find(const protobuf::Descriptor* type) ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_) {
    std::unique_ptr<MessageShape>& shape = shapes_[type];
    if (shape) return shape.get();
    // Known before its fields are, because a type may contain itself.
    shape = std::make_unique<MessageShape>();
    MessageShape* const made = shape.get();
    made->bytes = type->options().map_entry()
                      ? kMapNodeBytes
                      : static_cast<int64_t>(protobuf::MessageFactory::generated_factory()
                                                 ->GetPrototype(type)
                                                 ->SpaceUsedLong());
    for (int i = 0; i < type->field_count(); ++i) {
      const protobuf::FieldDescriptor& field = *type->field(i);
      if (field.number() > kMaxFieldNumber) continue;
      const auto number = static_cast<size_t>(field.number());
      if (made->fields.size() <= number) made->fields.resize(number + 1);
      // Find may move `shapes_`, but not the shapes.
      made->fields[number] = ShapeOf(field);
    }
    return made;
  }

  FieldShape ShapeOf(const protobuf::FieldDescriptor& field) ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_) {
    FieldShape shape;
    shape.is_repeated = field.is_repeated();
    switch (field.cpp_type()) {
      case protobuf::FieldDescriptor::CPPTYPE_MESSAGE:
        shape.kind = FieldShape::Kind::kMessage;
        shape.message = Find(field.message_type());
        break;
      case protobuf::FieldDescriptor::CPPTYPE_STRING:
        shape.kind = FieldShape::Kind::kString;
        break;
      default:
        shape.kind = FieldShape::Kind::kNumber;
        shape.number_bytes = BytesOf(field.cpp_type());
        shape.is_varint = WireFormatLite::WireTypeForFieldType(
                              static_cast<WireFormatLite::FieldType>(field.type())) ==
                          WireFormatLite::WIRETYPE_VARINT;
    }
    return shape;
  }

  Mutex mutex_;
  absl::flat_hash_map<const protobuf::Descriptor*, std::unique_ptr<MessageShape>> shapes_
      ABSL_GUARDED_BY(mutex_);
};

// Adds up what the fields of a message take.
class Estimate {
 public:
  explicit Estimate(CodedInputStream* input) : input_(*input) {}

  int64_t bytes() const { return bytes_; }

  // Reads the message up to the limit that is set, or up to the first fault. Returns whether there
  // was none.
  bool Read(const MessageShape& shape, int depth) {
    if (depth > kMaxDepth) return false;
    while (const uint32_t tag = input_.ReadTag()) {
      const auto number = static_cast<size_t>(WireFormatLite::GetTagFieldNumber(tag));
      const FieldShape& field = number < shape.fields.size() ? shape.fields[number] : kUnknownField;
      if (!ReadField(WireFormatLite::GetTagWireType(tag), field, depth)) return false;
    }
    return input_.ConsumedEntireMessage() || input_.BytesUntilLimit() == 0;
  }

 private:
  static constexpr FieldShape kUnknownField = {};

  bool ReadField(WireFormatLite::WireType type, const FieldShape& field, int depth) {
    switch (type) {
      case WireFormatLite::WIRETYPE_VARINT: {
        AddNumber(field);
        uint64_t ignored = 0;
        return input_.ReadVarint64(&ignored);
      }
      case WireFormatLite::WIRETYPE_FIXED64:
        AddNumber(field);
        return input_.Skip(8);
      case WireFormatLite::WIRETYPE_FIXED32:
        AddNumber(field);
        return input_.Skip(4);
      case WireFormatLite::WIRETYPE_LENGTH_DELIMITED: {
        uint32_t size = 0;
        if (!input_.ReadVarint32(&size) || size > INT32_MAX) return false;
        return ReadSized(static_cast<int>(size), field, depth);
      }
      case WireFormatLite::WIRETYPE_START_GROUP:
        // No message has groups. The fields of an unknown one are counted as if they stood here.
        bytes_ += kUnknownBytes + static_cast<int64_t>(sizeof(protobuf::UnknownFieldSet));
        return true;
      case WireFormatLite::WIRETYPE_END_GROUP:
        return true;
    }
    return false;
  }

  bool ReadSized(int size, const FieldShape& field, int depth) {
    switch (field.kind) {
      case FieldShape::Kind::kMessage: {
        bytes_ += field.message->bytes + (field.is_repeated ? kPointerBytes : 0);
        const CodedInputStream::Limit limit = input_.PushLimit(size);
        const bool complete = Read(*field.message, depth + 1);
        input_.PopLimit(limit);
        return complete;
      }
      case FieldShape::Kind::kString:
        bytes_ += (field.is_repeated ? kPointerBytes : 0) + BytesOfString(size);
        return input_.Skip(size);
      case FieldShape::Kind::kNumber:
        if (field.is_varint) return ReadPackedVarints(size, field);
        bytes_ += kGrowth * size;
        return input_.Skip(size);
      case FieldShape::Kind::kUnknown:
        bytes_ += kUnknownBytes + BytesOfString(size);
        return input_.Skip(size);
    }
    return false;
  }

  bool ReadPackedVarints(int size, const FieldShape& field) {
    while (size > 0) {
      const void* data = nullptr;
      int piece = 0;
      if (!input_.GetDirectBufferPointer(&data, &piece)) return false;
      piece = std::min(piece, size);
      const auto* const begin = static_cast<const uint8_t*>(data);
      // The last byte of a varint has no continuation bit.
      const auto numbers =
          std::count_if(begin, begin + piece, [](uint8_t byte) { return byte < 0x80; });
      bytes_ += kGrowth * field.number_bytes * numbers;
      input_.Skip(piece);
      size -= piece;
    }
    return true;
  }

  void AddNumber(const FieldShape& field) {
    if (field.kind != FieldShape::Kind::kNumber) {
      bytes_ += kUnknownBytes;
    } else if (field.is_repeated) {
      bytes_ += kGrowth * field.number_bytes;
    }
  }

  static int64_t BytesOfString(int size) {
    return kStringBytes + (size > kBytesInString ? size : 0);
  }

  CodedInputStream& input_;
  int64_t bytes_ = 0;
};

}  // namespace

int64_t MemoryOfMessage(const protobuf::Message& prototype, const grpc::ByteBuffer& bytes) {
  static Shapes* const shapes = new Shapes;  // never destroyed
  const MessageShape& shape = *shapes->Of(prototype.GetDescriptor());
  if (!bytes.Valid()) return shape.bytes;
  // The reader does not change the buffer.
  grpc::ProtoBufferReader reader(const_cast<grpc::ByteBuffer*>(&bytes));
  CodedInputStream input(&reader);
  Estimate estimate(&input);
  estimate.Read(shape, /*depth=*/0);
  return shape.bytes + estimate.bytes();
}

}  // namespace hypermap::wire
