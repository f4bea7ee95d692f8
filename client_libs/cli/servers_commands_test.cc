// Tests of the commands about servers that share a database.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>

#include "client_libs/cli/run.h"
#include "client_libs/cli/testing/run.h"
#include "client_libs/testing/scripted_server.h"

namespace hypermap::cli {
namespace {

using client::Script;
using client::ScriptedServer;
using ::testing::ElementsAre;
using ::testing::HasSubstr;

void AddServer(const std::string& id, int maps, bool draining, Script* script) {
  v1::SharingServer* const server = script->servers.add_servers();
  server->set_id(id);
  server->set_map_count(maps);
  server->set_draining(draining);
}

TEST(ServersCommandsTest, AServerIsDrainedOnceItOwnsNoMap) {
  Script script;
  AddServer("a", 0, true, &script);
  AddServer("b", 2, false, &script);
  ScriptedServer server(script);
  const Outcome outcome = RunOn(server, {"server", "drain", "a"});
  EXPECT_EQ(outcome.exit_code, kExitOk) << outcome.err;
  EXPECT_EQ(outcome.out, "a owns no map\n");
  EXPECT_THAT(server.Requests(), ElementsAre(R"(DrainServer server: "a")", "ListServers"));
}

TEST(ServersCommandsTest, AServerThatLivesNoMoreOwnsNoMap) {
  ScriptedServer server({});
  const Outcome outcome = RunOn(server, {"server", "drain", "a"});
  EXPECT_EQ(outcome.exit_code, kExitOk) << outcome.err;
}

TEST(ServersCommandsTest, WhatIsLeftIsToldUntilTheTimeIsOver) {
  Script script;
  AddServer("a", 2, true, &script);
  AddServer("b", 1, false, &script);
  ScriptedServer server(script);
  const Outcome outcome = RunOn(server, {"server", "drain", "a", "--timeout", "1s"});
  EXPECT_EQ(outcome.exit_code, kExitError);
  EXPECT_EQ(outcome.out, "");
  EXPECT_EQ(outcome.err, "a owns 2 maps\nhypermap: DEADLINE_EXCEEDED: a owns 2 maps still\n");
}

TEST(ServersCommandsTest, AServerThatIsStartedAnewMeanwhileIsNotDrained) {
  Script script;
  AddServer("a", 2, false, &script);
  ScriptedServer server(script);
  const Outcome outcome = RunOn(server, {"server", "drain", "a"});
  EXPECT_EQ(outcome.exit_code, kExitError);
  EXPECT_THAT(outcome.err, HasSubstr("ABORTED: a was started anew"));
}

TEST(ServersCommandsTest, ItIsToldThatNoServerTakesTheMaps) {
  Script script;
  AddServer("a", 1, true, &script);
  AddServer("b", 0, true, &script);
  ScriptedServer server(script);
  const Outcome outcome = RunOn(server, {"server", "drain", "a", "--timeout", "1s"});
  EXPECT_EQ(outcome.exit_code, kExitError);
  EXPECT_THAT(outcome.err, HasSubstr("a owns 1 map, which no other server takes: all are drained"));
}

TEST(ServersCommandsTest, ARefusalIsTold) {
  Script script;
  script.status = grpc::Status(grpc::StatusCode::NOT_FOUND, "no server \"x\" lives");
  ScriptedServer server(script);
  const Outcome outcome = RunOn(server, {"server", "drain", "x"});
  EXPECT_EQ(outcome.exit_code, kExitError);
  EXPECT_THAT(outcome.err, HasSubstr("no server \"x\" lives"));
}

}  // namespace
}  // namespace hypermap::cli
