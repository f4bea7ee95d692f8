#include <filesystem>
#include <fstream>
#include <iterator>
#include <map>
#include <optional>
#include <utility>
#include <vector>

#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"
#include "storage/geopackage/geopackage_store.h"
#include "storage/geopackage/testing/faulty_files.h"
#include "tests/histories/server_disk.h"
#include "tests/histories/volume.h"

namespace hypermap::histories {
namespace {

using storage::FileEvent;

// Share of the writes in which a call of the file system fails.
constexpr double kFileFault = 0.05;

std::string ReadAll(const std::filesystem::path& path) {
  std::ifstream file(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), {}};
}

class GeoPackageVolume : public Volume {
 public:
  GeoPackageVolume(Schedule* schedule, std::string folder)
      : schedule_(schedule),
        folder_(std::move(folder)),
        witness_name_(absl::StrCat(".", kMap, ".gpkg.lock")) {
    std::filesystem::create_directories(folder_);
    files_.emplace(folder_, witness_name_);
  }
  ~GeoPackageVolume() override {
    files_.reset();
    std::error_code ignored;
    std::filesystem::remove_all(folder_, ignored);
  }

  absl::StatusOr<std::unique_ptr<storage::MapStore>> Open() override {
    storage::GeoPackageOptions options;
    options.reserve_bytes = 0;
    return storage::OpenGeoPackageStore(folder_, options);
  }
  void set_faults(bool faults) override { faults_ = faults; }
  void BeginWrite(bool syncs) override {
    last_write_ = {files_->events().size(), 0};
    syncs_ = syncs;
    if (faults_ && schedule_->Chance(kFileFault)) Arm();
  }
  void EndWrite() override {
    files_->Disarm();
    last_write_.end = files_->events().size();
    if (!syncs_) not_synced_.push_back(last_write_);
  }
  void Crash() override {
    if (schedule_->Chance(0.5)) return LosePower(files_->events().size());
    // The kernel has all that the process has written.
    left_.clear();
    for (const auto& entry : std::filesystem::directory_iterator(folder_)) {
      const std::string name = entry.path().filename();
      if (entry.is_regular_file() && !absl::EndsWith(name, "-shm")) {
        left_[name] = ReadAll(entry.path());
      }
    }
  }
  void CrashDuringLastWrite() override {
    LosePower(static_cast<size_t>(schedule_->Pick(static_cast<int64_t>(last_write_.begin),
                                                  static_cast<int64_t>(last_write_.end))));
  }
  void Restart() override {
    files_.reset();
    not_synced_.clear();
    std::filesystem::remove_all(folder_);
    std::filesystem::create_directories(folder_);
    for (const auto& [name, bytes] : left_) {
      std::ofstream(folder_ + "/" + name, std::ios::binary) << bytes;
    }
    files_.emplace(folder_, witness_name_);
  }

 private:
  // Of recorded events.
  struct Range {
    size_t begin = 0;
    size_t end = 0;
  };

  void Arm() {
    storage::FileFault fault;
    switch (schedule_->Pick(0, 2)) {
      case 0:
        fault = {storage::FileCall::kWrite, SQLITE_FULL};
        fault.writes_half = schedule_->Chance(0.5);
        break;
      case 1:
        fault = {storage::FileCall::kWrite, SQLITE_IOERR_WRITE};
        break;
      default:
        fault = {storage::FileCall::kSync, SQLITE_IOERR_FSYNC};
    }
    fault.first = static_cast<int>(schedule_->Pick(1, 4));
    files_->Arm([](absl::string_view name) { return absl::StrContains(name, "site.gpkg"); }, fault);
  }
  // The power is lost after the first `end` events.
  void LosePower(size_t end) {
    const std::vector<FileEvent>& events = files_->events();
    storage::SimulatedDisk disk(static_cast<uint64_t>(schedule_->Pick(0, 1 << 30)));
    for (size_t i = 0; i < end; ++i) {
      if (!IsSkipped(i, events[i])) disk.Apply(events[i]);
    }
    left_ = disk.LosePower();
    if (end > 0) left_[witness_name_] = events[end - 1].witness;
  }
  bool IsSkipped(size_t i, const FileEvent& event) const {
    if (event.kind != FileEvent::Kind::kSync) return false;
    for (const Range& range : not_synced_) {
      if (i >= range.begin && i < range.end) return true;
    }
    return false;
  }

  Schedule* const schedule_;
  const std::string folder_;
  const std::string witness_name_;
  std::optional<storage::FaultyFiles> files_;
  bool faults_ = false;
  Range last_write_;
  bool syncs_ = true;
  std::vector<Range> not_synced_;
  std::map<std::string, std::string> left_;
};

}  // namespace

std::unique_ptr<Volume> MakeGeoPackageVolume(Schedule* schedule, const std::string& folder) {
  return std::make_unique<GeoPackageVolume>(schedule, folder);
}

}  // namespace hypermap::histories
