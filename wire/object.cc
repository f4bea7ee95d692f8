#include "wire/object.h"

#include <string>
#include <type_traits>
#include <utility>
#include <variant>

#include "absl/strings/str_cat.h"
#include "base/limits/limits.h"
#include "base/status/status_macros.h"
#include "wire/field.h"
#include "wire/geometry.h"
#include "wire/time.h"

namespace hypermap::wire {
namespace {

void EncodeAttribute(const AttributeValue& value, v1::AttributeValue* message) {
  struct Visitor {
    v1::AttributeValue* message;
    void operator()(bool v) const { message->set_bool_value(v); }
    void operator()(int64_t v) const { message->set_int_value(v); }
    void operator()(double v) const { message->set_double_value(v); }
    void operator()(const std::string& v) const { message->set_string_value(v); }
  };
  std::visit(Visitor{message}, value);
}

void EncodeShapeFields(const Shape& shape, v1::Object* message) {
  EncodeShape(shape, message->mutable_shape());
  EncodePoint(Centroid(shape), message->mutable_centroid());
}

absl::StatusOr<AttributeValue> DecodeAttribute(absl::string_view field,
                                               const v1::AttributeValue& message) {
  switch (message.value_case()) {
    case v1::AttributeValue::kBoolValue:
      return AttributeValue(message.bool_value());
    case v1::AttributeValue::kIntValue:
      return AttributeValue(int64_t{message.int_value()});
    case v1::AttributeValue::kDoubleValue:
      return AttributeValue(message.double_value());
    case v1::AttributeValue::kStringValue:
      return AttributeValue(message.string_value());
    case v1::AttributeValue::VALUE_NOT_SET:
      break;
  }
  return InvalidField(field, "has no value");
}

// Decodes everything but the shape.
absl::StatusOr<SemanticObject> DecodeProperties(absl::string_view field,
                                                const v1::Object& message) {
  SemanticObject object;
  object.id = message.id();
  object.label = message.label();
  object.classes = {message.classes().begin(), message.classes().end()};
  if (message.has_existence()) object.existence = message.existence();
  if (message.has_height()) {
    object.height = HeightRange{message.height().low_m(), message.height().high_m()};
  }
  object.tags = {message.tags().begin(), message.tags().end()};
  for (const auto& [name, value] : message.attributes()) {
    HYPERMAP_ASSIGN_OR_RETURN(
        AttributeValue attribute,
        DecodeAttribute(absl::StrCat(field, ".attributes[", name, "]"), value));
    object.attributes.emplace(name, std::move(attribute));
  }
  return object;
}

// `decode_shape` is called with the shape's field and message.
template <typename DecodeShapeMessage>
absl::StatusOr<SemanticObject> DecodeWith(absl::string_view field, const v1::Object& message,
                                          DecodeShapeMessage decode_shape) {
  const std::string shape_field = absl::StrCat(field, ".shape");
  if (!message.has_shape()) return InvalidField(shape_field, "is missing");
  HYPERMAP_ASSIGN_OR_RETURN(SemanticObject object, DecodeProperties(field, message));
  HYPERMAP_ASSIGN_OR_RETURN(object.shape, decode_shape(shape_field, message.shape()));
  return object;
}

}  // namespace

void EncodeRareFields(const SemanticObject& object, v1::Object* message) {
  if (!object.classes.empty()) {
    message->mutable_classes()->insert(object.classes.begin(), object.classes.end());
  }
  if (object.height) {
    message->mutable_height()->set_low_m(object.height->low_m);
    message->mutable_height()->set_high_m(object.height->high_m);
  }
  for (const std::string& tag : object.tags) message->add_tags(tag);
  for (const auto& [name, value] : object.attributes) {
    EncodeAttribute(value, &(*message->mutable_attributes())[name]);
  }
  if (object.expires_at) EncodeTime(*object.expires_at, message->mutable_expire_time());
}

void EncodeObject(const SemanticObject& object, const PlanarTransform& caller_from_object,
                  v1::Object* message) {
  message->set_id(object.id);
  message->set_label(object.label);
  message->set_existence(object.existence);
  if (caller_from_object.IsIdentity()) {
    EncodeShapeFields(object.shape, message);
  } else {
    EncodeShapeFields(caller_from_object * object.shape, message);
  }
  message->set_version(object.version);
  EncodeRareFields(object, message);
}

absl::StatusOr<SemanticObject> DecodeObject(absl::string_view field, const v1::Object& message,
                                            const Limits& limits) {
  return DecodeWith(field, message, [&](absl::string_view shape_field, const v1::Shape& shape) {
    return DecodeShape(shape_field, shape, limits);
  });
}

absl::StatusOr<SemanticObject> DecodeObject(absl::string_view field, const v1::Object& message) {
  HYPERMAP_ASSIGN_OR_RETURN(
      SemanticObject object,
      DecodeWith(field, message, [](absl::string_view shape_field, const v1::Shape& shape) {
        return DecodeShape(shape_field, shape);
      }));
  object.version = message.version();
  if (message.has_expire_time()) object.expires_at = DecodeTime(message.expire_time());
  return object;
}

}  // namespace hypermap::wire
