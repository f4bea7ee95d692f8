#include "server/auth/rpcs.h"

#include <gmock/gmock.h>
#include <google/protobuf/descriptor.h>
#include <gtest/gtest.h>

#include <set>
#include <string>

#include "absl/strings/str_cat.h"
#include "hypermap/v1/access_service.pb.h"
#include "hypermap/v1/catalog_service.pb.h"
#include "hypermap/v1/edit_service.pb.h"
#include "hypermap/v1/exploration_service.pb.h"
#include "hypermap/v1/ingest_service.pb.h"
#include "hypermap/v1/query_service.pb.h"
#include "hypermap/v1/robot_service.pb.h"
#include "hypermap/v1/server_service.pb.h"
#include "hypermap/v1/watch_service.pb.h"

namespace hypermap::server {
namespace {

TEST(RpcsTest, EachRpcHasItsRow) {
  std::set<std::string> described, rows;
  // A request of each service's file.
  for (const google::protobuf::Descriptor* request :
       {v1::GetCallerRequest::descriptor(), v1::GetMapRequest::descriptor(),
        v1::ApplyEditsRequest::descriptor(), v1::ClaimGoalRequest::descriptor(),
        v1::ObserveRequest::descriptor(), v1::QueryPointRequest::descriptor(),
        v1::ReportRequest::descriptor(), v1::ListServersRequest::descriptor(),
        v1::WatchRequest::descriptor()}) {
    const google::protobuf::FileDescriptor* const file = request->file();
    for (int i = 0; i < file->service_count(); ++i) {
      for (int j = 0; j < file->service(i)->method_count(); ++j) {
        described.insert(file->service(i)->method(j)->full_name());
      }
    }
  }
  for (const RpcInfo& row : AllRpcs()) {
    EXPECT_EQ(&InfoOf(row.rpc), &row);
    if (row.least) rows.insert(absl::StrCat(row.service, ".", row.method));
  }
  EXPECT_EQ(rows, described);
}

}  // namespace
}  // namespace hypermap::server
