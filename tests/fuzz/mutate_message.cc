#include "tests/fuzz/mutate_message.h"

#include <google/protobuf/descriptor.h>
#include <google/protobuf/io/tokenizer.h>
#include <google/protobuf/text_format.h>

#include <algorithm>
#include <cstring>
#include <limits>
#include <string>
#include <vector>

#include "tests/fuzz/random_values.h"

namespace hypermap::fuzz {
namespace {

using google::protobuf::FieldDescriptor;
using google::protobuf::Message;
using google::protobuf::Reflection;

constexpr int kMaxDepth = 10;

class SilentErrors : public google::protobuf::io::ErrorCollector {
 public:
  void AddError(int, int, const std::string&) override {}
};

// A message in the tree of the mutated one.
struct Node {
  Message* message;
  int depth;
};

void Collect(Message* message, int depth, std::vector<Node>* nodes) {
  nodes->push_back({message, depth});
  std::vector<const FieldDescriptor*> fields;
  const Reflection* const reflection = message->GetReflection();
  reflection->ListFields(*message, &fields);
  for (const FieldDescriptor* field : fields) {
    if (field->cpp_type() != FieldDescriptor::CPPTYPE_MESSAGE) continue;
    if (!field->is_repeated()) {
      Collect(reflection->MutableMessage(message, field), depth + 1, nodes);
      continue;
    }
    for (int i = 0; i < reflection->FieldSize(*message, field); ++i) {
      Collect(reflection->MutableRepeatedMessage(message, field, i), depth + 1, nodes);
    }
  }
}

// Sets a field, or element `i` of a repeated one, by the setter that `Set` and `SetRepeated` name.
template <typename Value, typename Set, typename SetRepeated>
void Assign(Message* message, const FieldDescriptor* field, int i, Set set,
            SetRepeated set_repeated, Value value) {
  const Reflection* const reflection = message->GetReflection();
  if (field->is_repeated()) {
    (reflection->*set_repeated)(message, field, i, std::move(value));
  } else {
    (reflection->*set)(message, field, std::move(value));
  }
}

std::string TextAt(const Message& message, const FieldDescriptor* field, int i) {
  const Reflection* const reflection = message.GetReflection();
  return field->is_repeated() ? reflection->GetRepeatedString(message, field, i)
                              : reflection->GetString(message, field);
}

void SetScalar(Message* message, const FieldDescriptor* field, int i, Rng& rng) {
  using R = Reflection;
  switch (field->cpp_type()) {
    case FieldDescriptor::CPPTYPE_INT32:
      return Assign(message, field, i, &R::SetInt32, &R::SetRepeatedInt32,
                    static_cast<int32_t>(RandomInteger(rng)));
    case FieldDescriptor::CPPTYPE_INT64:
      return Assign(message, field, i, &R::SetInt64, &R::SetRepeatedInt64, RandomInteger(rng));
    case FieldDescriptor::CPPTYPE_UINT32:
      return Assign(message, field, i, &R::SetUInt32, &R::SetRepeatedUInt32,
                    static_cast<uint32_t>(RandomInteger(rng)));
    case FieldDescriptor::CPPTYPE_UINT64:
      return Assign(message, field, i, &R::SetUInt64, &R::SetRepeatedUInt64,
                    static_cast<uint64_t>(RandomInteger(rng)));
    case FieldDescriptor::CPPTYPE_DOUBLE:
      return Assign(message, field, i, &R::SetDouble, &R::SetRepeatedDouble, RandomDouble(rng));
    case FieldDescriptor::CPPTYPE_FLOAT:
      return Assign(message, field, i, &R::SetFloat, &R::SetRepeatedFloat,
                    ToFloat(RandomDouble(rng)));
    case FieldDescriptor::CPPTYPE_BOOL:
      return Assign(message, field, i, &R::SetBool, &R::SetRepeatedBool, Below(rng, 2) == 0);
    case FieldDescriptor::CPPTYPE_ENUM:
      return Assign(message, field, i, &R::SetEnumValue, &R::SetRepeatedEnumValue,
                    Below(rng, field->enum_type()->value_count() + 1));
    case FieldDescriptor::CPPTYPE_STRING: {
      std::string text = MutatedText(TextAt(*message, field, i), rng);
      // Text format refuses strings that are not UTF-8, and so does the parser of requests.
      if (field->type() == FieldDescriptor::TYPE_STRING) KeepAscii(&text);
      return Assign(message, field, i, &R::SetString, &R::SetRepeatedString, std::move(text));
    }
    case FieldDescriptor::CPPTYPE_MESSAGE:
      return;
  }
}

void AddElement(Message* message, const FieldDescriptor* field) {
  const Reflection* const reflection = message->GetReflection();
  switch (field->cpp_type()) {
    case FieldDescriptor::CPPTYPE_INT32:
      return reflection->AddInt32(message, field, 0);
    case FieldDescriptor::CPPTYPE_INT64:
      return reflection->AddInt64(message, field, 0);
    case FieldDescriptor::CPPTYPE_UINT32:
      return reflection->AddUInt32(message, field, 0);
    case FieldDescriptor::CPPTYPE_UINT64:
      return reflection->AddUInt64(message, field, 0);
    case FieldDescriptor::CPPTYPE_DOUBLE:
      return reflection->AddDouble(message, field, 0);
    case FieldDescriptor::CPPTYPE_FLOAT:
      return reflection->AddFloat(message, field, 0);
    case FieldDescriptor::CPPTYPE_BOOL:
      return reflection->AddBool(message, field, false);
    case FieldDescriptor::CPPTYPE_ENUM:
      return reflection->AddEnumValue(message, field, 0);
    case FieldDescriptor::CPPTYPE_STRING:
      return reflection->AddString(message, field, "");
    case FieldDescriptor::CPPTYPE_MESSAGE:
      reflection->AddMessage(message, field);
      return;
  }
}

void MutateRepeated(const Node& node, const FieldDescriptor* field, Rng& rng) {
  const Reflection* const reflection = node.message->GetReflection();
  const int size = reflection->FieldSize(*node.message, field);
  const bool is_message = field->cpp_type() == FieldDescriptor::CPPTYPE_MESSAGE;
  const uint32_t action = Below(rng, 4);
  if (size == 0 || action == 0) {
    if (is_message && node.depth >= kMaxDepth) return;
    AddElement(node.message, field);
    // A copy of an element is more often valid than an empty one. Maps have distinct keys.
    if (is_message && size > 0 && !field->is_map()) {
      reflection->MutableRepeatedMessage(node.message, field, size)
          ->CopyFrom(reflection->GetRepeatedMessage(*node.message, field,
                                                    static_cast<int>(Below(rng, size))));
    } else {
      SetScalar(node.message, field, size, rng);
    }
  } else if (action == 1) {
    reflection->SwapElements(node.message, field, static_cast<int>(Below(rng, size)), size - 1);
    reflection->RemoveLast(node.message, field);
  } else if (action == 2) {
    reflection->SwapElements(node.message, field, static_cast<int>(Below(rng, size)),
                             static_cast<int>(Below(rng, size)));
  } else {
    SetScalar(node.message, field, static_cast<int>(Below(rng, size)), rng);
  }
}

void MutateSingle(const Node& node, const FieldDescriptor* field, Rng& rng) {
  const Reflection* const reflection = node.message->GetReflection();
  if (reflection->HasField(*node.message, field) && Below(rng, 5) == 0) {
    reflection->ClearField(node.message, field);
  } else if (field->cpp_type() != FieldDescriptor::CPPTYPE_MESSAGE) {
    SetScalar(node.message, field, 0, rng);
  } else if (node.depth < kMaxDepth) {
    reflection->MutableMessage(node.message, field);
  }
}

}  // namespace

void MutateMessage(Message* message, Rng& rng) {
  std::vector<Node> nodes;
  Collect(message, 0, &nodes);
  const Node& node = nodes[Below(rng, nodes.size())];
  const int num_fields = node.message->GetDescriptor()->field_count();
  if (num_fields == 0) return;
  const FieldDescriptor* const field =
      node.message->GetDescriptor()->field(static_cast<int>(Below(rng, num_fields)));
  if (field->is_repeated()) {
    MutateRepeated(node, field, rng);
  } else {
    MutateSingle(node, field, rng);
  }
}

bool ParseText(const uint8_t* data, size_t size, Message* message) {
  google::protobuf::TextFormat::Parser parser;
  SilentErrors errors;
  parser.RecordErrorsTo(&errors);
  parser.SetRecursionLimit(100);
  if (parser.ParseFromString(std::string(reinterpret_cast<const char*>(data), size), message)) {
    return true;
  }
  message->Clear();
  return false;
}

size_t MutateText(Message* message, uint8_t* data, size_t size, size_t max_size, unsigned seed) {
  Rng rng(seed + 1);
  ParseText(data, size, message);
  for (uint32_t n = 1 + Below(rng, 3); n > 0; --n) MutateMessage(message, rng);
  std::string text;
  google::protobuf::TextFormat::PrintToString(*message, &text);
  if (text.size() > max_size) return size;
  std::memcpy(data, text.data(), text.size());
  return text.size();
}

size_t MutateBytes(Message* message, uint8_t* data, size_t size, size_t max_size, unsigned seed) {
  Rng rng(seed + 1);
  if (Below(rng, 2) == 0 || !message->ParsePartialFromArray(data, static_cast<int>(size))) {
    return LLVMFuzzerMutate(data, size, max_size);
  }
  for (uint32_t n = 1 + Below(rng, 3); n > 0; --n) MutateMessage(message, rng);
  const std::string bytes = message->SerializePartialAsString();
  if (bytes.size() > max_size) return size;
  std::memcpy(data, bytes.data(), bytes.size());
  return bytes.size();
}

}  // namespace hypermap::fuzz
