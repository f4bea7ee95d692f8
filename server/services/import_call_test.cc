// Tests of how the files of an import arrive.
#include "server/services/import_call.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <memory>
#include <string>

#include "absl/strings/str_cat.h"
#include "server/services/testing/held_pool.h"
#include "server/services/testing/test_server.h"
#include "tests/support/eventually.h"
#include "tests/support/random_map.h"

namespace hypermap::server {
namespace {

using ::testing::IsEmpty;

// A GeoJSON file of unit squares.
std::string FileOfSquares(int num_squares) {
  std::string file = R"({"type":"FeatureCollection","features":[)";
  for (int i = 0; i < num_squares; ++i) {
    absl::StrAppend(&file, i == 0 ? "" : ",",
                    R"({"type":"Feature","properties":{"label":"cup"},"geometry":{"type":)",
                    R"("Polygon","coordinates":[[[)", 2 * i, ",0],[", 2 * i + 1, ",0],[", 2 * i + 1,
                    ",1],[", 2 * i, ",1],[", 2 * i, ",0]]]}}");
  }
  return absl::StrCat(file, "]}");
}

// A client's side of an import into a new map.
class Import {
 public:
  Import(TestServer& server, const std::string& map)
      : writer_(server.catalog->ImportMap(&context_, &response_)) {
    v1::ImportMapRequest request;
    request.mutable_header()->set_map(map);
    request.mutable_header()->set_format(v1::FILE_FORMAT_GEOJSON);
    request.mutable_header()->set_create_map(true);
    request.mutable_header()->set_layer("cups");
    request.mutable_header()->set_request_id("r1");
    writer_->Write(request);
  }

  bool Write(const std::string& data) {
    v1::ImportMapRequest request;
    request.mutable_chunk()->set_file_name("cups.geojson");
    request.mutable_chunk()->set_data(data);
    return writer_->Write(request);
  }
  void Cancel() { context_.TryCancel(); }
  grpc::Status Finish() {
    writer_->WritesDone();
    return writer_->Finish();
  }

 private:
  grpc::ClientContext context_;
  v1::ImportMapResponse response_;
  std::unique_ptr<grpc::ClientWriter<v1::ImportMapRequest>> writer_;
};

class ImportCallTest : public ::testing::Test {
 protected:
  int64_t SizeOf(const std::string& map) {
    const auto session = server_.site().Find(map);
    if (!session.ok()) return -1;
    return static_cast<int64_t>((*session)->snapshot()->FindLayer("cups")->Size());
  }
  int64_t bytes_on_disk() { return server_.budgets().scratch_bytes.used(); }
  int64_t memory() { return server_.budgets().request_bytes.used(); }

  TestServer server_;
};

TEST_F(ImportCallTest, ChunksOfAnySizeMakeTheSameMap) {
  const uint64_t seed = hypermap::testing::TestSeed();
  SCOPED_TRACE(absl::StrCat("HYPERMAP_TEST_SEED=", seed));
  hypermap::testing::Rng rng(seed);
  const std::string file = FileOfSquares(3000);
  for (int round = 0; round < 6; ++round) {
    const std::string map = absl::StrCat("site", round);
    Import import(server_, map);
    for (size_t at = 0; at < file.size();) {
      // Below and above the size that is counted at its arrival.
      const size_t most = rng() % 2 ? 1'000 : 100'000;
      const size_t size = std::min<size_t>(rng() % most, file.size() - at);
      ASSERT_TRUE(import.Write(file.substr(at, size)));
      at += size;
    }
    const grpc::Status status = import.Finish();
    ASSERT_TRUE(status.ok()) << status.error_message();
    EXPECT_EQ(SizeOf(map), 3000);
    // A retry in one piece is the same request.
    Import again(server_, map);
    ASSERT_TRUE(again.Write(file));
    const grpc::Status repeated = again.Finish();
    EXPECT_TRUE(repeated.ok()) << repeated.error_message();
  }
  EXPECT_TRUE(testing::Eventually([this] { return bytes_on_disk() == 0 && memory() == 0; }));
  EXPECT_THAT(server_.ScratchFiles(), IsEmpty());
}

TEST_F(ImportCallTest, CancelledImportsEndAtAnyPoint) {
  const uint64_t seed = hypermap::testing::TestSeed();
  SCOPED_TRACE(absl::StrCat("HYPERMAP_TEST_SEED=", seed));
  hypermap::testing::Rng rng(seed);
  const std::string small(500, ' '), large(200'000, ' ');
  for (int i = 0; i < 60; ++i) {
    Import import(server_, "site");
    const int num_chunks = static_cast<int>(rng() % 5);
    for (int j = 0; j < num_chunks; ++j) import.Write(rng() % 2 ? small : large);
    import.Cancel();
    EXPECT_FALSE(import.Finish().ok());
  }
  EXPECT_TRUE(testing::Eventually([this] { return bytes_on_disk() == 0 && memory() == 0; }));
  EXPECT_THAT(server_.ScratchFiles(), IsEmpty());
  EXPECT_EQ(SizeOf("site"), -1);
  Import whole(server_, "site");
  ASSERT_TRUE(whole.Write(FileOfSquares(1)));
  const grpc::Status status = whole.Finish();
  EXPECT_TRUE(status.ok()) << status.error_message();
}

TEST_F(ImportCallTest, AChunkWaitsForAWorkerAndHoldsItsBytesOnly) {
  Import import(server_, "site");
  ASSERT_TRUE(import.Write(FileOfSquares(1)));
  ASSERT_TRUE(testing::Eventually([this] { return bytes_on_disk() > 0; }));
  const int64_t before = bytes_on_disk();
  {
    HeldPool held(server_.workers().uploads);
    ASSERT_TRUE(import.Write(std::string(200'000, ' ')));
    ASSERT_TRUE(testing::Eventually([this] { return memory() > 200'000; }));
    EXPECT_LT(memory(), 201'000);
    EXPECT_EQ(bytes_on_disk(), before);
  }
  EXPECT_TRUE(testing::Eventually([&] { return bytes_on_disk() == before + 200'000; }));
  EXPECT_TRUE(testing::Eventually([this] { return memory() == 0; }));
  const grpc::Status status = import.Finish();
  EXPECT_TRUE(status.ok()) << status.error_message();
}

TEST_F(ImportCallTest, ACallThatIsCancelledWhileItsChunkWaitsEndsWhenAWorkerTakesIt) {
  auto import = std::make_unique<Import>(server_, "site");
  ASSERT_TRUE(import->Write(" "));
  ASSERT_TRUE(testing::Eventually([this] { return bytes_on_disk() > 0; }));
  HeldPool held(server_.workers().uploads);
  ASSERT_TRUE(import->Write(std::string(200'000, ' ')));
  ASSERT_TRUE(testing::Eventually([this] { return memory() > 0; }));
  import->Cancel();
  EXPECT_EQ(import->Finish().error_code(), grpc::StatusCode::CANCELLED);
  import.reset();
  held.Release();
  EXPECT_TRUE(testing::Eventually([this] { return server_.budgets().calls.used() == 0; }));
  EXPECT_EQ(memory(), 0);
  EXPECT_EQ(bytes_on_disk(), 0);
}

TEST_F(ImportCallTest, FilesArriveWhileOtherImportsAreDecoded) {
  HeldPool held(server_.workers().files);
  Import import(server_, "site");
  const std::string file = FileOfSquares(10);
  ASSERT_TRUE(import.Write(file));
  EXPECT_TRUE(
      testing::Eventually([&] { return bytes_on_disk() == static_cast<int64_t>(file.size()); }));
  held.Release();
  const grpc::Status status = import.Finish();
  EXPECT_TRUE(status.ok()) << status.error_message();
}

}  // namespace
}  // namespace hypermap::server
