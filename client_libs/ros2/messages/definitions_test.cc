#include "client_libs/ros2/messages/definitions.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdint>
#include <string>
#include <tuple>
#include <vector>

#include "absl/strings/ascii.h"
#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_split.h"
#include "client_libs/ros2/messages/messages.h"

namespace hypermap::ros2 {
namespace {

using ::testing::HasSubstr;
using ::testing::StartsWith;

// Describe the fields of a struct by their types, as DefinedFields does those of a definition: the
// fields of a message are in parentheses.
std::string FieldsOf(bool) { return "bool "; }
std::string FieldsOf(int8_t) { return "int8 "; }
std::string FieldsOf(uint8_t) { return "uint8 "; }
std::string FieldsOf(int32_t) { return "int32 "; }
std::string FieldsOf(uint32_t) { return "uint32 "; }
std::string FieldsOf(float) { return "float32 "; }
std::string FieldsOf(double) { return "float64 "; }
std::string FieldsOf(const std::string&) { return "string "; }
template <typename T>
std::string FieldsOf(const std::vector<T>& sequence);
template <typename T>
std::string FieldsOf(const T& message) {
  return std::apply(
      [](const auto&... fields) { return absl::StrCat("(", (FieldsOf(fields) + ...), ")"); },
      T::Tie(message));
}
template <typename T>
std::string FieldsOf(const std::vector<T>&) {
  return absl::StrCat("[]", FieldsOf(T()));
}

// Describes the fields of a type of `package` by its definition.
std::string DefinedFields(const std::string& package, std::string type) {
  if (absl::StrContains(type, "[]")) {
    return absl::StrCat("[]", DefinedFields(package, type.substr(0, type.size() - 2)));
  }
  if (!absl::StrContains(type, '/')) {
    if (absl::ascii_islower(type.front())) return absl::StrCat(type, " ");
    type = absl::StrCat(package, "/", type);
  }
  for (const DefinitionText& definition : DefinitionTexts()) {
    if (definition.type != type) continue;
    std::string fields;
    for (const absl::string_view line :
         absl::StrSplit(definition.text, '\n', absl::SkipWhitespace())) {
      if (line.front() == '#') continue;
      fields += DefinedFields(type.substr(0, type.find('/')),
                              std::string(line.substr(0, line.find(' '))));
    }
    return absl::StrCat("(", fields, ")");
  }
  return absl::StrCat("no definition of ", type);
}

template <typename Message>
class DefinitionTest : public testing::Test {};
using Messages =
    testing::Types<nav_msgs::OccupancyGrid, map_msgs::OccupancyGridUpdate, tf2_msgs::TFMessage,
                   visualization_msgs::MarkerArray, hypermap_msgs::SemanticMap>;
TYPED_TEST_SUITE(DefinitionTest, Messages);

TYPED_TEST(DefinitionTest, HasTheFieldsOfTheStruct) {
  const std::string name = RosTypeName(TypeParam::kType);
  const std::string type =
      absl::StrCat(name.substr(0, name.find('/')), name.substr(name.rfind('/')));
  EXPECT_EQ(FieldsOf(TypeParam()), DefinedFields("", type));
}

TEST(FullDefinitionTest, ContainsEachMessageThatIsUsedOnce) {
  EXPECT_EQ(RosTypeName(tf2_msgs::TFMessage::kType), "tf2_msgs/msg/TFMessage");
  const std::string line = std::string(80, '=') + "\n";
  const auto definition = FullDefinition("nav_msgs/msg/OccupancyGrid");
  ASSERT_TRUE(definition.ok()) << definition.status();
  EXPECT_THAT(*definition, StartsWith("std_msgs/Header header\nMapMetaData info\nint8[] data\n" +
                                      line + "MSG: std_msgs/Header\n"));
  EXPECT_THAT(*definition, HasSubstr(line + "MSG: nav_msgs/MapMetaData\n"));
  EXPECT_THAT(*definition, HasSubstr(line + "MSG: geometry_msgs/Quaternion\n"));
  const size_t time = definition->find("MSG: builtin_interfaces/Time\n");
  ASSERT_NE(time, std::string::npos);
  EXPECT_EQ(definition->find("MSG: builtin_interfaces/Time\n", time + 1), std::string::npos);
}

TEST(FullDefinitionTest, ReadsTheFilesOfTheProjectsOwnPackage) {
  const auto definition = FullDefinition("hypermap_msgs/msg/SemanticMap");
  ASSERT_TRUE(definition.ok()) << definition.status();
  EXPECT_THAT(*definition, HasSubstr("MSG: hypermap_msgs/SemanticObject\n"));
  EXPECT_THAT(*definition, HasSubstr("MSG: geometry_msgs/Point32\n"));
}

TEST(FullDefinitionTest, NamesAnUnknownMessage) {
  const auto definition = FullDefinition("nav_msgs/msg/Path");
  EXPECT_TRUE(absl::IsNotFound(definition.status()));
  EXPECT_THAT(definition.status().message(), HasSubstr("nav_msgs/Path"));
}

}  // namespace
}  // namespace hypermap::ros2
