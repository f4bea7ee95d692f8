#include "base/access/access_table.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>
#include <utility>

#include "absl/strings/str_cat.h"

namespace hypermap::access {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::Not;

const absl::Time kNow = absl::FromUnixSeconds(1'800'000'000);

TokenRecord Stored(const NewToken& token, absl::Time expires = absl::InfiniteFuture()) {
  return {token.id, token.digest, kNow, expires};
}

IdentityRecord Named(std::string name, Role role = Role::kReader) {
  IdentityRecord record;
  record.identity.name = std::move(name);
  record.identity.role = role;
  return record;
}

TEST(AccessTableTest, ReadsWhatTheDocumentationShows) {
  const AccessTable table = AccessTable::Parse(R"(
identities:
  - name: robot-7
    role: robot
    maps: ["hall-*"]
    robots: [robot-7-arm]
    certificates: [robot-7.example.org]
    tokens:
      - id: 5f0c6a1be2d4
        sha256: 9F86d081884c7d659a2feaa0c55ad015a3bf4f1b2b0b822cd15d6c15b0f00a08
        created: 2026-11-27T09:00:00Z
        expires: 2027-11-27T09:00:00Z
  - {name: anna, role: admin}
)")
                                .value();
  ASSERT_EQ(table.records().size(), 2);
  const IdentityRecord& robot = table.records()[0];
  EXPECT_EQ(robot.identity.name, "robot-7");
  EXPECT_EQ(robot.identity.role, Role::kRobot);
  EXPECT_THAT(robot.identity.maps, ElementsAre("hall-*"));
  EXPECT_THAT(robot.identity.robots, ElementsAre("robot-7-arm"));
  EXPECT_THAT(robot.certificates, ElementsAre("robot-7.example.org"));
  ASSERT_EQ(robot.tokens.size(), 1);
  EXPECT_EQ(robot.tokens[0].id, "5f0c6a1be2d4");
  EXPECT_THAT(robot.tokens[0].digest, HasSubstr("9f86d0"));
  EXPECT_EQ(robot.tokens[0].expires - robot.tokens[0].created, absl::Hours(24 * 365));
  const IdentityRecord& anna = table.records()[1];
  EXPECT_EQ(anna.identity.role, Role::kAdmin);
  EXPECT_THAT(anna.identity.maps, ElementsAre("*"));
  EXPECT_THAT(anna.tokens, IsEmpty());
}

TEST(AccessTableTest, EmptyFilesHaveNoIdentities) {
  for (const char* yaml : {"", "# nobody\n", "identities:\n", "identities: []\n"}) {
    EXPECT_THAT(AccessTable::Parse(yaml).value().records(), IsEmpty()) << yaml;
  }
}

TEST(AccessTableTest, MistakesAreNamedWithTheirLines) {
  const std::pair<const char*, const char*> mistakes[] = {
      {"identites: []", "line 1: \"identites\" is not one of identities"},
      {"identities: 3", "line 1: \"identities\" is no list"},
      {"identities:\n- 3", "line 2: not a mapping"},
      {"identities:\n- name: a\n  role: root", "line 3: role \"root\" is not reader"},
      {"identities:\n- name: a", "line 2: \"role\" is missing"},
      {"identities:\n- {name: a, role: robot, map: x}", "line 2: \"map\" is not one of name"},
      {"identities:\n- {name: a, role: robot, maps: x}", "line 2: \"maps\" is no list of texts"},
      {"identities:\n- {name: a, role: robot, maps: [[x]]}", "\"maps\" is no list of texts"},
      {"identities:\n- {name: a, role: robot, tokens: x}", "line 2: \"tokens\" is no list"},
      {"identities:\n- name: a\n  role: robot\n  tokens:\n  - {id: b, sha256: c}",
       "line 5: \"sha256\" is not 64 hexadecimal digits"},
      {"identities:\n- {name: a, role: robot}\n- {name: a, role: robot}",
       "identity \"a\" occurs twice"},
      {"identities:\n- {name: a, role: robot, certificates: [x]}\n"
       "- {name: b, role: robot, certificates: [x]}",
       "certificate \"x\" occurs twice"},
      {"identities:\n- {name: \"a\\nb\", role: robot}", "has control characters"},
      {"identities: [", "line 1"},
  };
  for (const auto& [yaml, problem] : mistakes) {
    const absl::Status status = AccessTable::Parse(yaml).status();
    EXPECT_TRUE(absl::IsInvalidArgument(status)) << yaml;
    EXPECT_THAT(status.message(), HasSubstr(problem)) << yaml;
  }
}

TEST(AccessTableTest, WhatIsWrittenIsReadAgain) {
  AccessTable table;
  IdentityRecord robot = Named("robot: \"7\" #", Role::kRobot);
  robot.identity.maps = {};
  robot.identity.robots = {"*"};
  robot.certificates = {"spiffe://site/robot"};
  robot.tokens = {Stored(MakeToken().value(), kNow + absl::Hours(1)), Stored(MakeToken().value())};
  ASSERT_TRUE(table.Add(robot).ok());
  ASSERT_TRUE(table.Add(Named("anna")).ok());
  const std::string text = table.Format();
  const AccessTable again = AccessTable::Parse(text).value();
  EXPECT_EQ(again.Format(), text);
  ASSERT_EQ(again.records().size(), 2);
  EXPECT_EQ(again.records()[0].identity.name, "robot: \"7\" #");
  EXPECT_THAT(again.records()[0].identity.maps, IsEmpty());
  EXPECT_EQ(again.records()[0].tokens[0].expires, kNow + absl::Hours(1));
  EXPECT_EQ(again.records()[0].tokens[1].expires, absl::InfiniteFuture());
}

TEST(AccessTableTest, TextsThatAreNotUtf8AreRefused) {
  // Written anew they would be other patterns.
  for (const char* field : {"maps", "robots", "certificates"}) {
    const std::string yaml =
        absl::StrCat("identities: [{name: anna, role: robot, ", field, ": [\"hall\xC0\"]}]");
    const absl::Status status = AccessTable::Parse(yaml).status();
    EXPECT_TRUE(absl::IsInvalidArgument(status)) << field;
    EXPECT_THAT(status.message(), HasSubstr("UTF-8"));
  }
}

TEST(AccessTableTest, NoncharactersAreRefused) {
  // YAML would have U+FFFD in their place.
  for (const char* fields : {"name: \"anna\xEF\xBF\xBF\", role: robot",
                             "name: anna, role: robot, maps: [\"hall\\uFDD0\"]"}) {
    const absl::Status status =
        AccessTable::Parse(absl::StrCat("identities: [{", fields, "}]")).status();
    EXPECT_TRUE(absl::IsInvalidArgument(status)) << fields;
    EXPECT_THAT(status.message(), HasSubstr("noncharacter"));
  }
}

TEST(AccessTableTest, TokensTellWhoCallsUntilTheyExpire) {
  const NewToken token = MakeToken().value(), other = MakeToken().value();
  AccessTable table;
  ASSERT_TRUE(table.Add(Named("anna")).ok());
  ASSERT_TRUE(table.AddToken("anna", Stored(token, kNow + absl::Hours(1))).ok());
  EXPECT_EQ(table.FindToken(token.text, kNow)->identity->name, "anna");
  EXPECT_EQ(table.FindToken(token.text, kNow)->expires, kNow + absl::Hours(1));
  const absl::Status expired = table.FindToken(token.text, kNow + absl::Hours(1)).status();
  EXPECT_TRUE(absl::IsUnauthenticated(expired));
  EXPECT_THAT(expired.message(), HasSubstr("has expired"));
  EXPECT_THAT(expired.message(), Not(HasSubstr(token.text)));
  std::string changed = token.text;
  changed.back() = changed.back() == '0' ? '1' : '0';
  for (const std::string& text : {other.text, changed, std::string(), std::string("x")}) {
    EXPECT_EQ(table.FindToken(text, kNow).status().message(), "the token is not known");
  }
}

TEST(AccessTableTest, RevokedTokensAreNotKnown) {
  const NewToken first = MakeToken().value(), second = MakeToken().value();
  AccessTable table;
  ASSERT_TRUE(table.Add(Named("anna")).ok());
  ASSERT_TRUE(table.AddToken("anna", Stored(first)).ok());
  ASSERT_TRUE(table.AddToken("anna", Stored(second)).ok());
  EXPECT_TRUE(absl::IsInvalidArgument(table.AddToken("anna", Stored(second))));
  ASSERT_TRUE(table.Revoke(first.id).ok());
  EXPECT_FALSE(table.FindToken(first.text, kNow).ok());
  EXPECT_TRUE(table.FindToken(second.text, kNow).ok());
  EXPECT_TRUE(absl::IsNotFound(table.Revoke(first.id)));
  EXPECT_TRUE(absl::IsNotFound(table.AddToken("bert", Stored(first))));
  ASSERT_TRUE(table.Remove("anna").ok());
  EXPECT_FALSE(table.FindToken(second.text, kNow).ok());
  EXPECT_TRUE(absl::IsNotFound(table.Remove("anna")));
}

TEST(AccessTableTest, CertificatesTellWhoCalls) {
  AccessTable table;
  IdentityRecord robot = Named("robot-7", Role::kRobot);
  robot.certificates = {"robot-7.example.org", "10.0.0.7"};
  ASSERT_TRUE(table.Add(robot).ok());
  EXPECT_EQ(table.FindCertificate({"other", "10.0.0.7"})->identity->name, "robot-7");
  EXPECT_TRUE(absl::IsUnauthenticated(table.FindCertificate({"other"}).status()));
}

TEST(AccessTableTest, AnErrorChangesNothing) {
  AccessTable table;
  IdentityRecord anna = Named("anna");
  anna.certificates = {"a"};
  ASSERT_TRUE(table.Add(anna).ok());
  EXPECT_TRUE(absl::IsAlreadyExists(table.Add(Named("anna"))));
  IdentityRecord bert = Named("bert");
  bert.certificates = {"a"};
  EXPECT_TRUE(absl::IsInvalidArgument(table.Add(bert)));
  EXPECT_TRUE(absl::IsInvalidArgument(table.Add(Named(""))));
  EXPECT_EQ(table.records().size(), 1);
  EXPECT_EQ(table.FindCertificate({"a"})->identity->name, "anna");
}

}  // namespace
}  // namespace hypermap::access
