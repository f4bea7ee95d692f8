#include "server/rpc/request_digest.h"

#include <gtest/gtest.h>

#include <set>
#include <string>
#include <utility>
#include <vector>

#include "hypermap/v1/catalog_service.pb.h"
#include "hypermap/v1/edit_service.pb.h"
#include "hypermap/v1/ingest_service.pb.h"

namespace hypermap::server {
namespace {

v1::ApplyEditsRequest TwoDeletions() {
  v1::ApplyEditsRequest request;
  request.set_map("site");
  request.set_request_id("r1");
  for (const int64_t id : {1, 2}) {
    v1::DeleteObject* const deletion = request.add_edits()->mutable_delete_object();
    deletion->set_layer("things");
    deletion->set_id(id);
  }
  request.add_if_layers()->set_layer("things");
  return request;
}

TEST(RequestDigestTest, RequestWithoutAnIdHasNone) {
  v1::ApplyEditsRequest request = TwoDeletions();
  EXPECT_EQ(DigestOf(request).size(), 16u);
  request.clear_request_id();
  EXPECT_EQ(DigestOf(request), "");
}

TEST(RequestDigestTest, IdAndIncarnationMakeNoDifference) {
  const v1::ApplyEditsRequest request = TwoDeletions();
  v1::ApplyEditsRequest other = request;
  other.set_request_id("r2");
  other.set_incarnation(7);
  EXPECT_EQ(DigestOf(request), DigestOf(other));
}

TEST(RequestDigestTest, C6EverythingElseMakesADifference) {
  std::set<std::string> digests = {DigestOf(TwoDeletions())};
  const auto add = [&digests](auto change) {
    v1::ApplyEditsRequest request = TwoDeletions();
    change(request);
    EXPECT_TRUE(digests.insert(DigestOf(request)).second) << request.ShortDebugString();
  };
  add([](auto& r) { r.set_map("lab"); });
  add([](auto& r) { r.mutable_edits(0)->mutable_delete_object()->set_id(3); });
  add([](auto& r) { r.mutable_edits()->SwapElements(0, 1); });
  add([](auto& r) { r.mutable_edits()->RemoveLast(); });
  add([](auto& r) { r.clear_edits(); });
  add([](auto& r) { r.clear_if_layers(); });
  add([](auto& r) { r.mutable_if_layers(0)->set_version(1); });
}

TEST(RequestDigestTest, C6RpcsWithTheSameFieldsDiffer) {
  v1::CreateMapRequest creation;
  creation.set_map("site");
  creation.set_request_id("r1");
  v1::CreateLayerRequest layer;
  layer.set_map("site");
  layer.set_request_id("r1");
  EXPECT_NE(DigestOf(creation), DigestOf(layer));
}

TEST(RequestDigestTest, C6ScalarsMakeADifference) {
  v1::RetractSourceRequest request;
  request.set_request_id("r1");
  std::set<std::string> digests = {DigestOf(request)};
  request.set_robot("a");
  EXPECT_TRUE(digests.insert(DigestOf(request)).second);
  request.mutable_from();
  EXPECT_TRUE(digests.insert(DigestOf(request)).second);
  request.mutable_from()->set_seconds(5);
  EXPECT_TRUE(digests.insert(DigestOf(request)).second);
}

std::string DigestOfPieces(const std::vector<std::pair<std::string, std::string>>& pieces) {
  RequestDigest digest((v1::ImportHeader()));
  for (const auto& [name, piece] : pieces) digest.AddPiece(name, piece);
  return std::move(digest).Finish();
}

TEST(RequestDigestTest, C6FilesMakeADifferenceButTheirPiecesDoNot) {
  const std::string whole = DigestOfPieces({{"a", "xyz"}, {"b", "w"}});
  EXPECT_EQ(DigestOfPieces({{"a", "x"}, {"a", ""}, {"a", "yz"}, {"b", "w"}}), whole);
  EXPECT_NE(DigestOfPieces({{"a", "xy"}, {"b", "zw"}}), whole);
  EXPECT_NE(DigestOfPieces({{"a", "xyzbw"}}), whole);
  EXPECT_NE(DigestOfPieces({{"c", "xyz"}, {"b", "w"}}), whole);
  EXPECT_NE(DigestOfPieces({{"a", "xyz"}, {"b", "w"}, {"c", ""}}), whole);
}

}  // namespace
}  // namespace hypermap::server
