// A store of maps that hands everything to another one.
#ifndef HYPERMAP_STORAGE_DECORATORS_FORWARDING_STORE_H_
#define HYPERMAP_STORAGE_DECORATORS_FORWARDING_STORE_H_

#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "storage/map_store.h"

namespace hypermap::storage {

// A decorator derives from it, and overrides what it changes.
class ForwardingStore : public MapStore {
 public:
  explicit ForwardingStore(std::unique_ptr<MapStore> store) : store_(std::move(store)) {}

  std::vector<std::string> notes() const override { return store_->notes(); }
  std::string server_id() const override { return store_->server_id(); }
  void Advertise(const std::string& address) override { store_->Advertise(address); }
  absl::Duration LeaseAge() const override { return store_->LeaseAge(); }
  absl::Status SetDraining(const std::string& server_id, bool draining) override {
    return store_->SetDraining(server_id, draining);
  }
  absl::StatusOr<Survey> TakeSurvey() override { return store_->TakeSurvey(); }
  absl::StatusOr<std::map<std::string, NewestRevision>> NewestRevisions(
      const std::vector<std::string>& names) override {
    return store_->NewestRevisions(names);
  }
  absl::Status RenewIncarnation(const std::string& name, uint64_t incarnation,
                                Revision shown) override {
    return store_->RenewIncarnation(name, incarnation, shown);
  }
  absl::StatusOr<std::unique_ptr<StoredMap>> Follow(const std::string& name) override {
    return store_->Follow(name);
  }
  absl::StatusOr<std::unique_ptr<ReadableMap>> Pin(const std::string& name) override {
    return store_->Pin(name);
  }
  absl::StatusOr<std::unique_ptr<StoredMap>> OpenUnfinishedCopy(const std::string& name) override {
    return store_->OpenUnfinishedCopy(name);
  }
  void ListenForChanges(const std::function<void(const std::string& map)>& heard) override {
    store_->ListenForChanges(heard);
  }
  absl::StatusOr<std::vector<std::string>> List() override { return store_->List(); }
  absl::StatusOr<std::unique_ptr<StoredMap>> Create(const MapHeader& header) override {
    return store_->Create(header);
  }
  absl::StatusOr<std::unique_ptr<StoredMap>> Open(const std::string& name) override {
    return store_->Open(name);
  }
  std::string FileStamp(const std::string& name) override { return store_->FileStamp(name); }
  absl::Status Delete(const std::string& name, const std::string& request_id) override {
    return store_->Delete(name, request_id);
  }
  absl::Status Discard(const std::string& name) override { return store_->Discard(name); }
  absl::Status RemoveOldTrash(absl::Time now) override { return store_->RemoveOldTrash(now); }
  absl::StatusOr<CheckReport> CheckFile(const std::string& path,
                                        const EvidenceCheck& evidence) override {
    return store_->CheckFile(path, evidence);
  }
  absl::Status Restore(const std::string& path, const std::string& name,
                       const std::string& request_id) override {
    return store_->Restore(path, name, request_id);
  }
  absl::StatusOr<std::optional<std::string>> FindDeletion(const std::string& request_id) override {
    return store_->FindDeletion(request_id);
  }

 protected:
  MapStore& store() const { return *store_; }

 private:
  const std::unique_ptr<MapStore> store_;
};

}  // namespace hypermap::storage

#endif  // HYPERMAP_STORAGE_DECORATORS_FORWARDING_STORE_H_
