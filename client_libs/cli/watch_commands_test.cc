// Tests of watch and changes: end and output.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <string>

#include "client_libs/cli/run.h"
#include "client_libs/cli/testing/run.h"
#include "client_libs/testing/scripted_server.h"
#include "map/snapshot.h"

namespace hypermap::cli {
namespace {

using client::Script;
using client::ScriptedServer;
using ::testing::ElementsAre;
using ::testing::HasSubstr;

v1::WatchResponse Removes(Revision revision, ObjectId id, bool snapshot = false) {
  v1::WatchResponse response;
  response.set_revision(revision);
  response.set_snapshot(snapshot);
  v1::Change* change = response.add_changes();
  change->set_kind(v1::CHANGE_KIND_REMOVE);
  change->set_layer("objects");
  change->set_object_id(id);
  return response;
}

TEST(WatchCommandTest, EndsAfterTheChangesThatWereWanted) {
  Script script;
  script.watches = {
      {{Removes(5, 1, true), Removes(6, 2), Removes(7, 3), Removes(8, 4)}, true, grpc::Status::OK}};
  const struct {
    Args options;
    int lines;  // two lines for the snapshot and its end, and one for each revision
  } cases[] = {
      {{"--count", "1"}, 3}, {{"--count", "2"}, 4}, {{"--until", "7"}, 4}, {{"--until", "5"}, 2}};
  for (const auto& c : cases) {
    ScriptedServer server(script);
    Args args = {"watch", "office", "--json"};
    args.insert(args.end(), c.options.begin(), c.options.end());
    const Outcome outcome = RunOn(server, args);
    EXPECT_EQ(outcome.exit_code, kExitOk) << outcome.err;
    EXPECT_EQ(std::count(outcome.out.begin(), outcome.out.end(), '\n'), c.lines) << outcome.out;
  }
}

TEST(WatchCommandTest, EndsAtTheTimeout) {
  Script script;
  script.watches = {{{Removes(5, 1)}, true, grpc::Status::OK}};
  ScriptedServer server(script);
  const Outcome outcome = RunOn(server, {"watch", "office", "--timeout", "100ms"});
  EXPECT_EQ(outcome.exit_code, kExitError);
  EXPECT_THAT(outcome.err, HasSubstr("DEADLINE_EXCEEDED"));
}

TEST(ChangesCommandTest, ComparesWithTheNewestAndTellsItsTime) {
  Script script;
  script.revisions.set_newest_revision(9);
  v1::RevisionInfo* newest = script.revisions.add_revisions();
  newest->set_revision(9);
  newest->mutable_time()->set_seconds(60);
  v1::ListChangesResponse part;
  part.set_from_revision(2);
  part.set_to_revision(9);
  *part.add_changes() = Removes(9, 4).changes(0);
  script.changes = {part};
  ScriptedServer server(script);
  const Outcome outcome = RunOn(server, {"changes", "office", "--from", "2", "--json"});
  EXPECT_EQ(outcome.exit_code, kExitOk) << outcome.err;
  EXPECT_EQ(outcome.out,
            R"({"revision":9,"time":"1970-01-01T00:01:00+00:00","layer":"objects","op":"remove",)"
            R"("id":4})"
            "\n"
            R"({"from_revision":2,"revision":9})"
            "\n");
  EXPECT_THAT(
      server.Requests(),
      ElementsAre(R"(ListRevisions map: "office" page_size: 1 newest_first: true)",
                  R"(ListChanges scope { map: "office" } from_revision: 2 to_revision: 9)"));
}

}  // namespace
}  // namespace hypermap::cli
