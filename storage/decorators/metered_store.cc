#include "storage/decorators/metered_store.h"

#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "base/sync/steady_time.h"
#include "storage/decorators/forwarding_map.h"
#include "storage/decorators/forwarding_store.h"

namespace hypermap::storage {
namespace {

const absl::Status& StatusOf(const absl::Status& status) { return status; }
template <typename T>
const absl::Status& StatusOf(const absl::StatusOr<T>& result) {
  return result.status();
}

template <typename Call>
auto Measured(StoreMeters* meters, StoreOperation operation, Call call) {
  const SteadyTime begin = SteadyTime::Now();
  auto result = call();
  meters->Add(operation, SteadyTime::Now() - begin, StatusOf(result));
  return result;
}

class MeteredMap : public ForwardingMap {
 public:
  MeteredMap(std::unique_ptr<StoredMap> map, StoreMeters* meters)
      : ForwardingMap(std::move(map)), meters_(meters) {}

  absl::StatusOr<SnapshotPtr> Load() override {
    return Measured(meters_, StoreOperation::kLoad, [&] { return map().Load(); });
  }
  absl::Status Write(absl::Span<const Commit> commits) override {
    return Measured(meters_, StoreOperation::kWrite, [&] { return map().Write(commits); });
  }
  absl::StatusOr<std::optional<Receipt>> FindReceipt(absl::string_view request_id) override {
    return Measured(meters_, StoreOperation::kFindReceipts,
                    [&] { return map().FindReceipt(request_id); });
  }
  absl::StatusOr<std::vector<Receipt>> FindReceipts(
      absl::Span<const std::string> request_ids) override {
    return Measured(meters_, StoreOperation::kFindReceipts,
                    [&] { return map().FindReceipts(request_ids); });
  }
  absl::StatusOr<bool> Compact(Revision oldest, absl::Time receipts_before, int max_rows) override {
    return Measured(meters_, StoreOperation::kCompact,
                    [&] { return map().Compact(oldest, receipts_before, max_rows); });
  }

 private:
  StoreMeters* const meters_;
};

class MeteredStore : public ForwardingStore {
 public:
  MeteredStore(std::unique_ptr<MapStore> store, StoreMeters* meters)
      : ForwardingStore(std::move(store)), meters_(meters) {}

  absl::StatusOr<Survey> TakeSurvey() override {
    return Measured(meters_, StoreOperation::kSurvey, [&] { return store().TakeSurvey(); });
  }
  absl::StatusOr<std::map<std::string, NewestRevision>> NewestRevisions(
      const std::vector<std::string>& names) override {
    return Measured(meters_, StoreOperation::kNewestRevisions,
                    [&] { return store().NewestRevisions(names); });
  }
  absl::StatusOr<std::unique_ptr<StoredMap>> Follow(const std::string& name) override {
    return MeterMap(Measured(meters_, StoreOperation::kOpen, [&] { return store().Follow(name); }));
  }
  absl::StatusOr<std::unique_ptr<StoredMap>> Create(const MapHeader& header) override {
    return MeterMap(store().Create(header));
  }
  absl::StatusOr<std::unique_ptr<StoredMap>> Open(const std::string& name) override {
    return MeterMap(Measured(meters_, StoreOperation::kOpen, [&] { return store().Open(name); }));
  }

 private:
  absl::StatusOr<std::unique_ptr<StoredMap>> MeterMap(
      absl::StatusOr<std::unique_ptr<StoredMap>> map) {
    if (!map.ok()) return map;
    return std::make_unique<MeteredMap>(*std::move(map), meters_);
  }

  StoreMeters* const meters_;
};

}  // namespace

std::unique_ptr<MapStore> MakeMeteredStore(std::unique_ptr<MapStore> store, StoreMeters* meters) {
  return std::make_unique<MeteredStore>(std::move(store), meters);
}

}  // namespace hypermap::storage
