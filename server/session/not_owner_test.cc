#include "server/session/not_owner.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <memory>
#include <optional>
#include <string>
#include <utility>

#include "server/session/site.h"
#include "server/session/testing/memory_map_store.h"

namespace hypermap::server {
namespace {

using ::testing::HasSubstr;

TEST(NotOwnerTest, TheErrorHasTheAddressOfTheOwner) {
  const absl::Status error = NotOwnerError("hall", "10.0.0.2:50051");
  EXPECT_TRUE(absl::IsUnavailable(error));
  EXPECT_EQ(OwnerAddressOf(error), "10.0.0.2:50051");
  EXPECT_THAT(std::string(error.message()),
              HasSubstr("\"hall\" is owned by the server at 10.0.0.2:50051"));
}

TEST(NotOwnerTest, OtherErrorsHaveNone) {
  EXPECT_EQ(OwnerAddressOf(NotOwnerError("hall", "")), std::nullopt);
  EXPECT_TRUE(absl::IsUnavailable(NotOwnerError("hall", "")));
  EXPECT_EQ(OwnerAddressOf(absl::UnavailableError("down")), std::nullopt);
  EXPECT_EQ(OwnerAddressOf(absl::OkStatus()), std::nullopt);
}

class OwnedElsewhereTest : public ::testing::Test {
 protected:
  OwnedElsewhereTest() {
    site_ = Site::Open(std::make_unique<MemoryMapStore>(&disk_), {}).value();
    session_ = site_->Create({"hall", "map", ""}).value();
  }

  EditBatch Batch() const {
    EditBatch batch;
    LayerSpec spec;
    spec.name = "objects";
    batch.edits.push_back(CreateLayer{spec});
    return batch;
  }

  MemoryDisk disk_;
  std::unique_ptr<Site> site_;
  std::shared_ptr<MapSession> session_;
};

TEST_F(OwnedElsewhereTest, AllThatNeedsTheWriterIsRefusedWithTheOwner) {
  session_->SetOwner("10.0.0.2:50051");
  const absl::Status errors[] = {
      session_->CheckOwner(),
      site_->CheckOwner("hall"),
      session_->SubmitAndWait({Batch(), "anna", ""}).status(),
      session_->RunAndWait({StartFusion{"cups", {}}, "anna", ""}).status(),
      session_->FindReceipt("r").status(),
      session_->InspectFusion("cups", [](FusedLayer&) { return absl::OkStatus(); }),
      session_->ReadEvidence("cups", {}, 1).status(),
      session_->ReadRobotClocks().status(),
      session_->BackupTo("/nowhere", [](int64_t) { return absl::OkStatus(); }),
      session_->Check().status(),
  };
  for (const absl::Status& error : errors) EXPECT_EQ(OwnerAddressOf(error), "10.0.0.2:50051");
  EXPECT_EQ(session_->snapshot()->revision, 0);
}

TEST_F(OwnedElsewhereTest, TheOwnerCarriesItOut) {
  session_->SetOwner("10.0.0.2:50051");
  session_->SetOwner(std::nullopt);
  EXPECT_EQ(session_->CheckOwner(), absl::OkStatus());
  EXPECT_EQ(session_->SubmitAndWait({Batch(), "anna", ""}).status(), absl::OkStatus());
}

TEST_F(OwnedElsewhereTest, AnUnknownOwnerIsAnErrorToTryAgain) {
  session_->SetOwner("");
  const absl::Status error = session_->SubmitAndWait({Batch(), "anna", ""}).status();
  EXPECT_TRUE(absl::IsUnavailable(error)) << error;
  EXPECT_EQ(OwnerAddressOf(error), std::nullopt);
}

TEST_F(OwnedElsewhereTest, AMapThatIsNotThereHasNoOwner) {
  EXPECT_EQ(site_->CheckOwner("yard"), absl::OkStatus());
}

TEST(NotOwnerTest, AMapThatIsNotOpenHereCanNameItsOwnerToo) {
  MemoryDisk disk;
  auto store = std::make_unique<MemoryMapStore>(&disk);
  store->AddBroken("hall", NotOwnerError("hall", "10.0.0.2:50051"));
  store->AddBroken("yard", absl::DataLossError("damaged"));
  const std::unique_ptr<Site> site = Site::Open(std::move(store), {}).value();
  EXPECT_EQ(OwnerAddressOf(site->Find("hall").status()), "10.0.0.2:50051");
  EXPECT_EQ(OwnerAddressOf(site->CheckOwner("hall")), "10.0.0.2:50051");
  EXPECT_EQ(site->CheckOwner("yard"), absl::OkStatus());
}

}  // namespace
}  // namespace hypermap::server
