#include "tests/bench/server/shared_site.h"

#include <algorithm>
#include <utility>

#include "absl/strings/str_cat.h"
#include "absl/time/clock.h"
#include "base/status/status_macros.h"
#include "hypermap/v1/edit_service.pb.h"
#include "storage/encoding/geometry_blob.h"
#include "storage/libpq/connection.h"
#include "storage/postgres/postgres_store.h"
#include "tests/bench/server/edit_calls.h"
#include "wire/geometry.h"

namespace hypermap::bench {
namespace {

using storage::postgres::Cluster;

// By these ids, the first one owns kSiteMap, whichever starts first (server/session/placement.h).
constexpr char kOwner[] = "b";
constexpr char kFollower[] = "a";

// A commit must not take the database so long that the store gives it up.
constexpr int64_t kObjectsPerCommit = 50'000;

constexpr char kGroups[] =
    "SELECT count(*) FROM hypermap.revisions WHERE revision > $1 "
    "GROUP BY xmin::text ORDER BY min(revision)";

// The object that replaces another one in the n-th edit.
SemanticObject ReplacingObject(const GeneratedSite& site, int64_t n) {
  SemanticObject object = EditedObject(site, n);
  object.existence = 0.5 + static_cast<double>(n % 100) / 200;
  return object;
}

std::string RequestId(int64_t n) { return absl::StrCat("bench-request-of-some-length-", n); }

absl::StatusOr<std::unique_ptr<storage::postgres::Connection>> ConnectTo(
    const std::string& target) {
  return storage::postgres::Connection::Open({.target = target});
}

}  // namespace

SharedSite::SharedSite(const Options& options)
    : options_(options), site_(options.objects), scratch_(options.scratch) {}

absl::StatusOr<std::unique_ptr<SharedSite>> SharedSite::Make(const Options& options) {
  HYPERMAP_RETURN_IF_ERROR(Cluster::Installed());
  std::unique_ptr<SharedSite> shared(new SharedSite(options));
  HYPERMAP_ASSIGN_OR_RETURN(
      shared->cluster_,
      Cluster::Create(
          {.is_durable = true, .settings = {"shared_buffers=1GB", "max_wal_size=4GB", "jit=off"}}));
  HYPERMAP_RETURN_IF_ERROR(shared->Fill());
  return shared;
}

absl::Status SharedSite::Fill() {
  HYPERMAP_ASSIGN_OR_RETURN(served_, cluster_->CreateDatabase());
  {
    HYPERMAP_ASSIGN_OR_RETURN(const auto store,
                              storage::OpenPostgresStore({.target = served_, .server_id = kOwner}));
    HYPERMAP_RETURN_IF_ERROR(WriteSite(store.get(), site_, kObjectsPerCommit));
  }
  {
    HYPERMAP_ASSIGN_OR_RETURN(const auto connection, ConnectTo(served_));
    // As autovacuum does, which is off: not the tables that are empty.
    HYPERMAP_RETURN_IF_ERROR(connection->Execute("ANALYZE hypermap.objects, hypermap.changes"));
  }
  HYPERMAP_ASSIGN_OR_RETURN(bare_target_, cluster_->CreateDatabase(served_));
  HYPERMAP_ASSIGN_OR_RETURN(const auto connection, ConnectTo(bare_target_));
  HYPERMAP_RETURN_IF_ERROR(connection->Execute("CHECKPOINT"));
  HYPERMAP_ASSIGN_OR_RETURN(bare_, BareDatabase::Open(bare_target_));
  return absl::OkStatus();
}

absl::StatusOr<std::unique_ptr<testing::ServerProcess>> SharedSite::StartServer(
    const std::string& id) const {
  const std::string database = served_.substr(served_.rfind('=') + 1);
  return StartHypermap(
      options_, absl::StrCat(scratch_.path(), "/", id),
      {absl::StrCat("--store=postgresql://postgres@127.0.0.1:", cluster_->port(), "/", database),
       absl::StrCat("--server_id=", id)});
}

absl::StatusOr<std::unique_ptr<testing::ServerProcess>> SharedSite::StartOwner() const {
  return StartServer(kOwner);
}

absl::StatusOr<std::unique_ptr<testing::ServerProcess>> SharedSite::StartFollower() const {
  return StartServer(kFollower);
}

Calls SharedSite::EditCalls() {
  Calls calls;
  calls.method = "/hypermap.v1.EditService/ApplyEdits";
  calls.request = [this](int64_t) {
    const int64_t n = edits_.fetch_add(1);
    const SemanticObject object = ReplacingObject(site_, n);
    v1::ApplyEditsRequest request;
    request.set_map(kSiteMap);
    request.set_request_id(RequestId(n));
    v1::PutObject* const put = request.add_edits()->mutable_put_object();
    put->set_layer(kObjectsLayer);
    put->mutable_object()->set_id(object.id);
    put->mutable_object()->set_label(object.label);
    put->mutable_object()->set_existence(object.existence);
    wire::EncodeShape(object.shape, put->mutable_object()->mutable_shape());
    return ToBytes(request);
  };
  return calls;
}

absl::StatusOr<std::vector<int>> SharedSite::GroupsAfter(Revision revision) const {
  HYPERMAP_ASSIGN_OR_RETURN(const auto connection, ConnectTo(served_));
  HYPERMAP_ASSIGN_OR_RETURN(auto rows, connection->Query(kGroups, revision));
  std::vector<int> groups;
  while (rows.Next()) groups.push_back(static_cast<int>(rows.Int64(0)));
  HYPERMAP_RETURN_IF_ERROR(rows.row_status());
  if (groups.empty()) return absl::InternalError("no edit was made");
  return groups;
}

absl::StatusOr<Cost> SharedSite::BareEdits(const std::vector<int>& groups, absl::Duration each) {
  absl::Duration passed;
  int64_t count = 0;
  for (size_t i = 0; passed < each; ++i) {
    std::vector<BareEdit> edits;
    for (int j = 0; j < groups[i % groups.size()]; ++j) {
      const int64_t n = edits_.fetch_add(1);
      SemanticObject object = ReplacingObject(site_, n);
      std::string shape = storage::EncodeGeometryBlob(object.shape);
      edits.push_back({std::move(object), std::move(shape), RequestId(n)});
    }
    const absl::Time start = absl::Now();
    HYPERMAP_RETURN_IF_ERROR(bare_->Commit(edits));
    passed += absl::Now() - start;
    count += static_cast<int64_t>(edits.size());
  }
  return Cost{0, absl::ToDoubleSeconds(passed) / static_cast<double>(count), 0, 0};
}

}  // namespace hypermap::bench
