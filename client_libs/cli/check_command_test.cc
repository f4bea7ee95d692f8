// check, digest and restore as whole command lines. What a check finds is tested beside
// storage/geopackage.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>

#include "client_libs/cli/testing/run.h"
#include "client_libs/testing/scripted_server.h"

namespace hypermap::cli {
namespace {

using client::Script;
using client::ScriptedServer;
using ::testing::Contains;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

constexpr int kNotChecked = 2;

TEST(CheckCommandTest, FindingsOfAServersMapAreShownWithExitCode1) {
  Script script;
  script.check.set_revision(7);
  v1::Finding& finding = *script.check.add_findings();
  finding.set_table("things");
  finding.set_row("id 3");
  finding.set_problem("cut short");
  ScriptedServer server(script);
  const Outcome table = RunOn(server, {"check", "office"});
  EXPECT_EQ(table.exit_code, kExitError);
  EXPECT_THAT(table.err, IsEmpty());
  EXPECT_THAT(table.out, HasSubstr("id 3"));
  EXPECT_THAT(table.out, HasSubstr("office: 1 finding, revision 7"));
  const Outcome json = RunOn(server, {"--json", "check", "office"});
  EXPECT_EQ(json.exit_code, kExitError);
  EXPECT_THAT(json.out, HasSubstr(R"("problem":"cut short")"));
  EXPECT_THAT(json.out, HasSubstr(R"("can_be_rebuilt":false)"));
  EXPECT_THAT(server.Requests(), Contains(R"(CheckMap map: "office")"));
}

TEST(CheckCommandTest, CleanMapHasExitCode0) {
  ScriptedServer server(Script{});
  const Outcome outcome = RunOn(server, {"check", "office"});
  EXPECT_EQ(outcome.exit_code, kExitOk) << outcome.err;
  EXPECT_THAT(outcome.out, HasSubstr("nothing is wrong"));
}

TEST(CheckCommandTest, WhatCannotBeCheckedHasExitCode2) {
  testing::TemporaryFolder folder;
  Put(folder / "text.gpkg", "no database");
  for (const Args& args : {Args{"check", folder / "none.gpkg"}, Args{"check", folder / "text.gpkg"},
                           Args{"check", folder.path()}, Args{"check", "office", "--repair"}}) {
    const Outcome outcome = RunCommand(args);
    EXPECT_EQ(outcome.exit_code, kNotChecked) << outcome.err;
    EXPECT_THAT(outcome.out, IsEmpty());
  }
  Script script;
  script.status = grpc::Status(grpc::StatusCode::NOT_FOUND, "no such map");
  ScriptedServer server(script);
  EXPECT_EQ(RunOn(server, {"check", "office"}).exit_code, kNotChecked);
}

TEST(DigestCommandTest, DigestsOfLayersAreShownWithTheirRevision) {
  Script script;
  script.digest.set_map("office");
  script.digest.set_revision(7);
  script.digest.set_incarnation(9);
  script.digest.set_frames_digest("f00d");
  v1::LayerDigest& layer = *script.digest.add_layers();
  layer.set_layer("things");
  layer.set_digest("beef");
  layer.set_version(5);
  script.digest.add_layers()->set_layer("unreadable");
  ScriptedServer server(script);
  const Outcome table = RunOn(server, {"digest", "office"});
  EXPECT_EQ(table.exit_code, kExitOk) << table.err;
  EXPECT_THAT(table.out, HasSubstr("things               5  beef"));
  EXPECT_THAT(table.out, HasSubstr("unreadable           0  -"));
  EXPECT_THAT(table.out, HasSubstr("office: revision 7, incarnation 9"));
  const Outcome json = RunOn(server, {"--json", "digest", "office"});
  EXPECT_THAT(json.out, HasSubstr(R"("layers":{"things":"beef","unreadable":""})"));
  EXPECT_THAT(json.out, HasSubstr(R"("frames":"f00d")"));
  EXPECT_THAT(server.Requests(), Contains(R"(DigestMap map: "office")"));
}

TEST(RestoreCommandTest, SendsTheFileUnderItsName) {
  testing::TemporaryFolder folder;
  Put(folder / "office.gpkg", "SQLite format 3");
  ScriptedServer server(Script{});
  const Outcome outcome = RunOn(server, {"restore", folder / "office.gpkg"});
  EXPECT_EQ(outcome.exit_code, kExitOk) << outcome.err;
  EXPECT_THAT(outcome.out, HasSubstr("office restored"));
  EXPECT_EQ(
      RunOn(server, {"restore", folder / "office.gpkg", "--map", "lab", "--replace"}).exit_code,
      kExitOk);
  EXPECT_THAT(server.Requests(), Contains(HasSubstr(R"(RestoreMap map: "office")")));
  EXPECT_THAT(server.Requests(), Contains(HasSubstr(R"(RestoreMap map: "lab" replace: true)")));
  EXPECT_EQ(RunOn(server, {"restore", folder / "none.gpkg"}).exit_code, kExitError);
}

}  // namespace
}  // namespace hypermap::cli
