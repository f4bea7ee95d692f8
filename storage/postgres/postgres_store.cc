#include "storage/postgres/postgres_store.h"

#include <filesystem>
#include <map>
#include <optional>
#include <system_error>
#include <utility>
#include <vector>

#include "absl/base/thread_annotations.h"
#include "absl/functional/function_ref.h"
#include "absl/strings/str_cat.h"
#include "absl/time/clock.h"
#include "base/cancellation/cancellation.h"
#include "base/status/status_macros.h"
#include "base/sync/mutex.h"
#include "map/layers/layer_spec.h"
#include "storage/decorators/read_only_map.h"
#include "storage/incarnation.h"
#include "storage/libpq/connection.h"
#include "storage/postgres/change_hints.h"
#include "storage/postgres/database_guard.h"
#include "storage/postgres/deleted_maps.h"
#include "storage/postgres/durability.h"
#include "storage/postgres/file_copies.h"
#include "storage/postgres/layer_versions.h"
#include "storage/postgres/layer_views.h"
#include "storage/postgres/map_row.h"
#include "storage/postgres/open_names.h"
#include "storage/postgres/postgres_map.h"
#include "storage/postgres/schema.h"
#include "storage/postgres/server_lease.h"
#include "storage/transfer/map_copy.h"
#include "storage/unfinished_copy.h"

namespace hypermap::storage {
namespace postgres {
namespace {

// How often the row of a map is looked at that another server owns.
constexpr absl::Duration kLeasePause = absl::Milliseconds(100);
// Callers wait for this read, which waits for no locks.
constexpr absl::Duration kNewestTimeout = absl::Seconds(5);
// The SQLSTATE of a session that pg_terminate_backend has ended.
constexpr char kSessionEnded[] = "57P01";
constexpr int kOpenAttempts = 5;
// Rows of deleted maps that are removed in one step.
constexpr int kRowsPerStep = 5000;

class PostgresStore : public MapStore {
 public:
  PostgresStore(PostgresOptions options, std::unique_ptr<DatabaseGuard> guard,
                std::unique_ptr<Connection> catalog, std::unique_ptr<ServerLease> lease,
                std::unique_ptr<LayerViews> views, std::vector<std::string> notes)
      : options_(std::move(options)),
        guard_(std::move(guard)),
        lease_(std::move(lease)),
        views_(std::move(views)),
        notes_(std::move(notes)),
        catalog_(std::move(catalog)) {}

  std::vector<std::string> notes() const override { return notes_; }

  std::string server_id() const override { return options_.server_id; }
  void Advertise(const std::string& address) override { lease_->Advertise(address); }
  absl::Duration LeaseAge() const override { return lease_->Age(); }
  absl::Status SetDraining(const std::string& server_id, bool draining) override;
  absl::StatusOr<Survey> TakeSurvey() override;
  absl::StatusOr<std::map<std::string, NewestRevision>> NewestRevisions(
      const std::vector<std::string>& names) override;
  absl::Status RenewIncarnation(const std::string& name, uint64_t incarnation,
                                Revision shown) override;
  absl::StatusOr<std::unique_ptr<StoredMap>> Follow(const std::string& name) override;
  void ListenForChanges(const std::function<void(const std::string& map)>& heard) override;
  absl::StatusOr<std::vector<std::string>> List() override;
  absl::StatusOr<std::unique_ptr<StoredMap>> Create(const MapHeader& header) override;
  absl::StatusOr<std::unique_ptr<StoredMap>> Open(const std::string& name) override;
  absl::StatusOr<std::unique_ptr<ReadableMap>> Pin(const std::string& name) override;
  absl::StatusOr<std::unique_ptr<StoredMap>> OpenUnfinishedCopy(const std::string& name) override;
  absl::StatusOr<CheckReport> CheckFile(const std::string& path,
                                        const EvidenceCheck& evidence) override;
  absl::Status Restore(const std::string& path, const std::string& name,
                       const std::string& request_id) override;
  std::string FileStamp(const std::string& name) override;
  absl::Status Delete(const std::string& name, const std::string& request_id) override;
  absl::Status RemoveOldTrash(absl::Time now) override;
  absl::StatusOr<std::optional<std::string>> FindDeletion(const std::string& request_id) override;

 private:
  // Runs `run` in one transaction. If the connection breaks, so that it is not known whether the
  // transaction was committed, runs it again once: it finds out what it has done.
  absl::Status Change(absl::FunctionRef<absl::Status(Connection*)> run);
  // Reads with one statement; again once if the connection turns out to be broken.
  absl::StatusOr<Rows> Read(const std::string& sql, const Parameters& parameters);
  // Opens a connection, on which maps may be opened.
  absl::StatusOr<std::unique_ptr<Connection>> Connect(const ConnectOptions& options);
  // The connection of the catalog; a new one if the last one broke.
  absl::StatusOr<Connection*> Catalog() ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);

  // Makes a map, whose name may be a hidden one. ALREADY_EXISTS.
  absl::StatusOr<std::unique_ptr<StoredMap>> Make(const MapHeader& header);
  // Copies a map of another store into an unfinished copy of that name, and puts it in the place of
  // the map `name` in one step. FAILED_PRECONDITION if that one is open in another server.
  absl::Status Import(ReadableMap& from, const std::string& hidden, const std::string& name);
  // FAILED_PRECONDITION if a server that lives has the map open, unless it is this one.
  absl::Status CheckClosed(const MapRow& row) const;

  enum class Sort { kMap, kUnfinishedCopy };
  absl::StatusOr<std::unique_ptr<StoredMap>> OpenAs(const std::string& name, Sort sort);
  // The row of a map that may be read whoever owns it. NOT_FOUND.
  absl::StatusOr<MapRow> FindForReading(const std::string& name);

  // The row of a map that this server has taken, or the one of a server that has it.
  struct Taking {
    MapRow found;
    std::optional<OwnedMap::Row> taken;
  };
  // Makes this server the owner of a map, unless another's lease lasts. NOT_FOUND.
  absl::StatusOr<Taking> TryTake(const std::string& name, Sort sort);
  // Whether the creation of a map was not completed, and nobody is at it.
  bool IsLeftIncomplete(const MapRow& row) const {
    return row.header.provisional && (!row.is_owned || row.owner == options_.server_id);
  }
  // Waits for the end of a lease that is not renewed any more. FAILED_PRECONDITION if it is.
  absl::StatusOr<Taking> Take(const std::string& name, Sort sort);
  absl::StatusOr<std::unique_ptr<StoredMap>> OpenOwned(const MapRow& row,
                                                       const OwnedMap::Row& owned, NameHolder name);
  absl::StatusOr<std::unique_ptr<StoredMap>> OpenRow(std::unique_ptr<OwnedMap> map,
                                                     const MapRow& row, PostgresMap::Events events);
  // Tells that there may be other maps or layers to show to programs that read the database.
  void UpdateViews();
  // Tells the servers that use the database, once ListenForChanges was called.
  void Announce(const std::string& map);
  absl::Status DeleteIn(Connection* connection, const std::string& name,
                        const std::string& request_id, std::optional<int64_t>* deleted);
  ConnectOptions WriterOptions() const;
  PostgresMap::Facilities ForMaps() const;

  const PostgresOptions options_;
  const std::unique_ptr<DatabaseGuard> guard_;
  const std::unique_ptr<ServerLease> lease_;
  const std::unique_ptr<LayerViews> views_;  // null if there can be none
  const std::vector<std::string> notes_;
  OpenNames open_;
  Mutex hints_mutex_;
  std::unique_ptr<ChangeHints> hints_ ABSL_GUARDED_BY(hints_mutex_);
  Mutex mutex_;
  std::unique_ptr<Connection> catalog_ ABSL_GUARDED_BY(mutex_);
  // A connection of their own for questions that wait, because the catalog's may wait for locks.
  Mutex newest_mutex_;
  std::unique_ptr<Connection> newest_ ABSL_GUARDED_BY(newest_mutex_);
};

absl::Status ReadLayers(OwnedMap& map, Revision revision, OpenLayers* layers) {
  HYPERMAP_ASSIGN_OR_RETURN(Connection* const connection, map.connection());
  HYPERMAP_ASSIGN_OR_RETURN(std::vector<LayerAt> read,
                            ReadLayersAt(*connection, map.map(), revision));
  for (LayerAt& layer : read) {
    std::string name = layer.stored.spec.name;
    layers->by_name.emplace(std::move(name), std::move(layer.stored));
  }
  return absl::OkStatus();
}

// PostgreSQL cuts an application_name off after 63 bytes, and sessions of a server are found by it.
constexpr size_t kMaxServerId = 50;

absl::Status CheckServerId(const std::string& id) {
  HYPERMAP_RETURN_IF_ERROR(ValidateName("server_id", id));
  if (id.size() <= kMaxServerId) return absl::OkStatus();
  return absl::InvalidArgumentError(
      absl::StrCat("server_id has ", id.size(), " bytes, more than ", kMaxServerId));
}

ConnectOptions WriterOptionsOf(const PostgresOptions& options) {
  ConnectOptions connect;
  connect.target = options.target;
  connect.application_name = ApplicationNameOf(options.server_id);
  return connect;
}

ConnectOptions PostgresStore::WriterOptions() const { return WriterOptionsOf(options_); }

PostgresMap::Facilities PostgresStore::ForMaps() const {
  ConnectOptions readers = WriterOptions();
  if (!options_.readers_target.empty()) {
    readers.target = options_.readers_target;
    readers.prepares = false;  // there may be a pooler
  }
  return {std::move(readers), options_.cache_room, options_.open_files};
}

absl::StatusOr<std::unique_ptr<Connection>> PostgresStore::Connect(const ConnectOptions& options) {
  HYPERMAP_ASSIGN_OR_RETURN(std::unique_ptr<Connection> connection, Connection::Open(options));
  HYPERMAP_RETURN_IF_ERROR(guard_->Check(connection.get()));
  return connection;
}

absl::StatusOr<Connection*> PostgresStore::Catalog() {
  if (catalog_ == nullptr || catalog_->is_broken()) {
    catalog_.reset();
    HYPERMAP_ASSIGN_OR_RETURN(catalog_, Connect(WriterOptions()));
  }
  return catalog_.get();
}

absl::Status PostgresStore::Change(absl::FunctionRef<absl::Status(Connection*)> run) {
  const MutexLock lock(&mutex_);
  for (int attempt = 0;; ++attempt) {
    HYPERMAP_ASSIGN_OR_RETURN(Connection* const catalog, Catalog());
    absl::Status status = [&]() -> absl::Status {
      HYPERMAP_ASSIGN_OR_RETURN(Transaction transaction, Transaction::Begin(catalog));
      HYPERMAP_RETURN_IF_ERROR(run(catalog));
      return transaction.Commit();
    }();
    if (status.ok() || !catalog->is_broken() || attempt > 0) return status;
  }
}

absl::StatusOr<Rows> PostgresStore::Read(const std::string& sql, const Parameters& parameters) {
  const MutexLock lock(&mutex_);
  for (int attempt = 0;; ++attempt) {
    HYPERMAP_ASSIGN_OR_RETURN(Connection* const catalog, Catalog());
    absl::StatusOr<Rows> rows = catalog->Run(sql, parameters);
    if (rows.ok() || !catalog->is_broken() || attempt > 0) return rows;
  }
}

absl::StatusOr<std::vector<std::string>> PostgresStore::List() {
  HYPERMAP_ASSIGN_OR_RETURN(
      Rows rows,
      Read("SELECT name FROM hypermap.maps WHERE name IS NOT NULL AND NOT unfinished_copy "
           "ORDER BY name",
           Parameters()));
  std::vector<std::string> names;
  while (rows.Next()) names.emplace_back(rows.Text(0));
  HYPERMAP_RETURN_IF_ERROR(rows.row_status());
  return names;
}

absl::StatusOr<std::unique_ptr<StoredMap>> PostgresStore::Create(const MapHeader& header) {
  HYPERMAP_RETURN_IF_ERROR(ValidateName("map", header.name));
  HYPERMAP_RETURN_IF_ERROR(ValidateFrameId("frame_id", header.frame_id));
  return Make(header);
}

absl::StatusOr<std::unique_ptr<StoredMap>> PostgresStore::Make(const MapHeader& header) {
  MapRow made;
  made.header = header;
  if (header.incarnation == 0) made.header.incarnation = NewIncarnation();
  absl::StatusOr<NameHolder> name = NameHolder::Take(&open_, header.name);
  const auto exists = [&] {
    return absl::AlreadyExistsError(absl::StrCat("map ", header.name, " exists"));
  };
  if (!name.ok()) return exists();
  // By this number a second attempt knows what the first one has made.
  OwnedMap::Row owned;
  owned.last_write = static_cast<int64_t>(NewIncarnation());
  const absl::Status status = Change([&](Connection* connection) -> absl::Status {
    HYPERMAP_ASSIGN_OR_RETURN(std::optional<MapRow> found, FindMap(connection, header.name));
    if (found && found->last_write != owned.last_write && IsLeftIncomplete(*found)) {
      HYPERMAP_RETURN_IF_ERROR(RemoveName(connection, found->id));
      found.reset();
    }
    if (!found) {
      HYPERMAP_RETURN_IF_ERROR(
          InsertMap(connection, made.header, options_.server_id, owned.last_write));
      // Another row if the name was taken meanwhile, perhaps by the first attempt.
      HYPERMAP_ASSIGN_OR_RETURN(found, FindMap(connection, header.name));
    }
    if (!found || found->last_write != owned.last_write) return exists();
    owned.map = found->id;
    owned.epoch = found->epoch;
    return absl::OkStatus();
  });
  HYPERMAP_RETURN_IF_ERROR(status);
  return OpenOwned(made, owned, *std::move(name));
}

absl::StatusOr<std::unique_ptr<StoredMap>> PostgresStore::Open(const std::string& name) {
  return OpenAs(name, Sort::kMap);
}

absl::StatusOr<std::unique_ptr<StoredMap>> PostgresStore::OpenUnfinishedCopy(
    const std::string& name) {
  return OpenAs(name, Sort::kUnfinishedCopy);
}

absl::StatusOr<std::unique_ptr<StoredMap>> PostgresStore::OpenAs(const std::string& name,
                                                                 Sort sort) {
  HYPERMAP_RETURN_IF_ERROR(ValidateName("map", name));
  HYPERMAP_ASSIGN_OR_RETURN(NameHolder holder, NameHolder::Take(&open_, name));
  HYPERMAP_ASSIGN_OR_RETURN(const Taking taking, Take(name, sort));
  // The other servers pass calls on to this one from now on.
  Announce("");
  return OpenOwned(taking.found, *taking.taken, std::move(holder));
}

absl::StatusOr<PostgresStore::Taking> PostgresStore::Take(const std::string& name, Sort sort) {
  std::optional<int64_t> lease_until_us;
  while (true) {
    HYPERMAP_ASSIGN_OR_RETURN(Taking taking, TryTake(name, sort));
    if (taking.taken) return taking;
    if (lease_until_us.value_or(taking.found.lease_until_us) != taking.found.lease_until_us) {
      return absl::FailedPreconditionError(
          absl::StrCat("map ", name, " is open in server ", taking.found.owner));
    }
    lease_until_us = taking.found.lease_until_us;
    HYPERMAP_RETURN_IF_ERROR(CheckCancelled());
    absl::SleepFor(kLeasePause);
  }
}

absl::StatusOr<PostgresStore::Taking> PostgresStore::TryTake(const std::string& name, Sort sort) {
  Taking taking;
  bool is_incomplete = false;
  const absl::Status status = Change([&](Connection* connection) -> absl::Status {
    // What an attempt before has taken may be another's by now.
    taking = {};
    is_incomplete = false;
    HYPERMAP_RETURN_IF_ERROR(EndSessionsOfLostOwner(connection, name));
    HYPERMAP_ASSIGN_OR_RETURN(std::optional<MapRow> found, FindMap(connection, name));
    if (!found) return absl::NotFoundError(absl::StrCat("no map ", name));
    taking.found = *std::move(found);
    const bool is_copy = taking.found.header.unfinished_copy;
    if (is_copy && sort == Sort::kMap) return UnfinishedCopyError(name);
    if (!is_copy && sort == Sort::kUnfinishedCopy) {
      return absl::FailedPreconditionError(absl::StrCat("map ", name, " is no unfinished copy"));
    }
    if (taking.found.is_owned && taking.found.owner != options_.server_id) return absl::OkStatus();
    is_incomplete = taking.found.header.provisional;
    if (is_incomplete) return RemoveName(connection, taking.found.id);
    HYPERMAP_ASSIGN_OR_RETURN(taking.taken, TakeMap(connection, taking.found, options_.server_id));
    return absl::OkStatus();
  });
  HYPERMAP_RETURN_IF_ERROR(status);
  if (is_incomplete) {
    return absl::NotFoundError(absl::StrCat("the creation of map ", name, " was not completed"));
  }
  return taking;
}

absl::StatusOr<std::unique_ptr<StoredMap>> PostgresStore::OpenOwned(const MapRow& row,
                                                                    const OwnedMap::Row& owned,
                                                                    NameHolder name) {
  PostgresMap::Events events;
  events.written = [this, map = row.header.name] { Announce(map); };
  events.layers_changed = [this] { UpdateViews(); };
  events.closed = [this, give = std::move(name).Give()] {
    give();
    // Others may take the map.
    Announce("");
  };
  return OpenRow(std::make_unique<OwnedMap>(WriterOptions(), owned), row, std::move(events));
}

absl::StatusOr<std::unique_ptr<StoredMap>> PostgresStore::OpenRow(std::unique_ptr<OwnedMap> map,
                                                                  const MapRow& row,
                                                                  PostgresMap::Events events) {
  PostgresMap::Opened opened{row.header, row.revision, row.oldest_revision, {}, {}};
  opened.layers.next_lineage = row.next_lineage;
  if (auto note = guard_->TakeNote(row.header.incarnation)) {
    opened.notes.push_back(*std::move(note));
  }
  absl::Status status = ReadLayers(*map, row.revision, &opened.layers);
  // Also if it can't be opened: it releases the map.
  auto stored = std::make_unique<PostgresMap>(std::move(map), ForMaps(), std::move(opened),
                                              std::move(events));
  if (status.ok()) return stored;
  return absl::Status(status.code(), absl::StrCat("map ", row.header.name, ": ", status.message()));
}

absl::Status PostgresStore::SetDraining(const std::string& server_id, bool draining) {
  HYPERMAP_RETURN_IF_ERROR(Change([&](Connection* connection) {
    return postgres::SetDraining(connection, server_id, draining);
  }));
  // All servers plan anew.
  Announce("");
  return absl::OkStatus();
}

absl::StatusOr<Survey> PostgresStore::TakeSurvey() {
  Survey survey;
  const absl::Status status = Change([&](Connection* connection) -> absl::Status {
    HYPERMAP_ASSIGN_OR_RETURN(survey, ReadSurvey(connection));
    return absl::OkStatus();
  });
  HYPERMAP_RETURN_IF_ERROR(status);
  return survey;
}

absl::StatusOr<std::map<std::string, NewestRevision>> PostgresStore::NewestRevisions(
    const std::vector<std::string>& names) {
  const MutexLock lock(&newest_mutex_);
  for (int attempt = 0;; ++attempt) {
    if (newest_ == nullptr || newest_->is_broken()) {
      newest_.reset();
      // Of the primary: a standby may not have all that was acknowledged.
      ConnectOptions options = WriterOptions();
      options.response_timeout = kNewestTimeout;
      HYPERMAP_ASSIGN_OR_RETURN(newest_, Connect(options));
    }
    auto newest = ReadNewestRevisions(newest_.get(), names);
    if (newest.ok() || !newest_->is_broken() || attempt > 0) return newest;
  }
}

absl::Status PostgresStore::RenewIncarnation(const std::string& name, uint64_t incarnation,
                                             Revision shown) {
  std::optional<uint64_t> renewed;
  const absl::Status status = Change([&](Connection* connection) -> absl::Status {
    HYPERMAP_ASSIGN_OR_RETURN(renewed,
                              postgres::RenewIncarnation(connection, name, incarnation, shown));
    return absl::OkStatus();
  });
  HYPERMAP_RETURN_IF_ERROR(status);
  if (!renewed) return absl::OkStatus();
  guard_->AddNote(
      *renewed, absl::StrCat("the database has lost revision ", shown, ", which was shown before"));
  Announce("");
  return absl::OkStatus();
}

absl::StatusOr<MapRow> PostgresStore::FindForReading(const std::string& name) {
  HYPERMAP_RETURN_IF_ERROR(ValidateName("map", name));
  std::optional<MapRow> found;
  const absl::Status status = Change([&](Connection* connection) -> absl::Status {
    HYPERMAP_ASSIGN_OR_RETURN(found, FindMap(connection, name, RowLock::kNone));
    return absl::OkStatus();
  });
  HYPERMAP_RETURN_IF_ERROR(status);
  if (!found || found->header.provisional || found->header.unfinished_copy) {
    return absl::NotFoundError(absl::StrCat("no map ", name));
  }
  return *std::move(found);
}

absl::StatusOr<std::unique_ptr<StoredMap>> PostgresStore::Follow(const std::string& name) {
  HYPERMAP_ASSIGN_OR_RETURN(const MapRow found, FindForReading(name));
  HYPERMAP_ASSIGN_OR_RETURN(
      std::unique_ptr<StoredMap> followed,
      OpenRow(OwnedMap::OfAnother(ForMaps().readers, found.id), found, NoEvents()));
  return MakeReadOnlyMap(std::move(followed),
                         absl::FailedPreconditionError("the map is open for reading only"));
}

absl::StatusOr<std::unique_ptr<ReadableMap>> PostgresStore::Pin(const std::string& name) {
  HYPERMAP_ASSIGN_OR_RETURN(const MapRow found, FindForReading(name));
  return PinMap(ForMaps(), found.id, found.header);
}

absl::StatusOr<CheckReport> PostgresStore::CheckFile(const std::string& path,
                                                     const EvidenceCheck& evidence) {
  if (options_.open_files == nullptr) return MapStore::CheckFile(path, evidence);
  return CheckFileOf(options_.open_files, path, evidence);
}

absl::Status PostgresStore::Restore(const std::string& path, const std::string& name,
                                    const std::string& request_id) {
  if (options_.open_files == nullptr) return MapStore::Restore(path, name, request_id);
  HYPERMAP_RETURN_IF_ERROR(ValidateName("map", name));
  HYPERMAP_ASSIGN_OR_RETURN(const NameHolder holder, NameHolder::Take(&open_, name));
  std::optional<MapRow> found;
  const absl::Status status = Change([&](Connection* connection) -> absl::Status {
    HYPERMAP_ASSIGN_OR_RETURN(found, FindMap(connection, name));
    return found ? CheckClosed(*found) : absl::OkStatus();
  });
  HYPERMAP_RETURN_IF_ERROR(status);
  const bool is_done = found && !request_id.empty() && found->header.request_id == request_id;
  if (!is_done) {
    HYPERMAP_RETURN_IF_ERROR(
        UseMapInFile(options_.open_files, path, name, request_id,
                     [&](StoredMap& map) { return Import(map, HiddenNameOf(name), name); }));
    Announce("");
    UpdateViews();
  }
  std::error_code ignored;
  std::filesystem::remove(path, ignored);
  return absl::OkStatus();
}

absl::Status PostgresStore::Import(ReadableMap& from, const std::string& hidden,
                                   const std::string& name) {
  MapHeader header = from.header();
  header.name = hidden;
  header.unfinished_copy = true;
  HYPERMAP_ASSIGN_OR_RETURN(const std::unique_ptr<StoredMap> copy, Make(header));
  absl::Status status = CopyMap(from, *copy);
  if (status.ok()) {
    status = Change([&](Connection* connection) -> absl::Status {
      HYPERMAP_ASSIGN_OR_RETURN(const std::optional<MapRow> found, FindMap(connection, name));
      HYPERMAP_ASSIGN_OR_RETURN(const std::optional<MapRow> made, FindMap(connection, hidden));
      // The attempt before may have been committed.
      if (!made && found && found->header.incarnation == header.incarnation) {
        return absl::OkStatus();
      }
      if (!made) return absl::UnavailableError("the copy was removed before it was complete");
      if (found) {
        HYPERMAP_RETURN_IF_ERROR(CheckClosed(*found));
        HYPERMAP_RETURN_IF_ERROR(RemoveName(connection, found->id));
      }
      return PublishCopy(connection, made->id, name, options_.server_id);
    });
  }
  // If this fails, the next start of a server does it.
  if (!status.ok()) {
    Change([&](Connection* connection) { return RemoveHidden(connection, hidden); }).IgnoreError();
  }
  return status;
}

absl::Status PostgresStore::CheckClosed(const MapRow& row) const {
  if (!row.is_owned || row.owner == options_.server_id) return absl::OkStatus();
  return absl::FailedPreconditionError(
      absl::StrCat("map ", row.header.name, " is open in server ", row.owner));
}

void PostgresStore::ListenForChanges(const std::function<void(const std::string& map)>& heard) {
  const MutexLock lock(&hints_mutex_);
  if (hints_ == nullptr && heard == nullptr) return;
  if (hints_ == nullptr) hints_ = ChangeHints::Start(WriterOptions());
  hints_->Listen(heard);
}

void PostgresStore::Announce(const std::string& map) {
  const MutexLock lock(&hints_mutex_);
  if (hints_ != nullptr) hints_->Announce(map);
}

void PostgresStore::UpdateViews() {
  if (views_ != nullptr) views_->Wake();
}

std::string PostgresStore::FileStamp(const std::string& name) {
  absl::StatusOr<Rows> rows =
      Read("SELECT id, epoch, last_write, coalesce(owner, '') FROM hypermap.maps WHERE name = $1",
           Parameters(name));
  if (!rows.ok() || !rows->Next()) return "";
  return absl::StrCat(rows->Int64(0), " ", rows->Int64(1), " ", rows->Int64(2), " ", rows->Text(3));
}

absl::Status PostgresStore::Delete(const std::string& name, const std::string& request_id) {
  HYPERMAP_RETURN_IF_ERROR(ValidateName("map", name));
  std::optional<int64_t> deleted;
  absl::Status status = Change(
      [&](Connection* connection) { return DeleteIn(connection, name, request_id, &deleted); });
  if (status.ok()) UpdateViews();
  return status;
}

absl::Status PostgresStore::DeleteIn(Connection* connection, const std::string& name,
                                     const std::string& request_id,
                                     std::optional<int64_t>* deleted) {
  HYPERMAP_ASSIGN_OR_RETURN(const std::optional<MapRow> found, FindMap(connection, name));
  // The attempt before may have been committed.
  if (*deleted && !(found && found->id == **deleted)) return absl::OkStatus();
  HYPERMAP_ASSIGN_OR_RETURN(const std::optional<std::string> earlier,
                            postgres::FindDeletion(connection, request_id));
  if (earlier && *earlier != name) {
    return absl::InvalidArgumentError(
        absl::StrCat("request_id ", request_id, " was used to delete map ", *earlier));
  }
  if (earlier && found) {
    return absl::FailedPreconditionError(
        absl::StrCat("request_id \"", request_id, "\" deleted an earlier map \"", name,
                     "\"; the present one was made since and is not deleted"));
  }
  if (earlier) return absl::OkStatus();
  if (!found) return absl::NotFoundError(absl::StrCat("no map ", name));
  if (open_.Contains(name)) {
    return absl::FailedPreconditionError(absl::StrCat("map ", name, " is open"));
  }
  HYPERMAP_RETURN_IF_ERROR(CheckClosed(*found));
  *deleted = found->id;
  HYPERMAP_RETURN_IF_ERROR(RemoveName(connection, found->id));
  return RecordDeletion(connection, request_id, name);
}

absl::Status PostgresStore::RemoveOldTrash(absl::Time /*now*/) {
  HYPERMAP_RETURN_IF_ERROR(
      Change([](Connection* connection) { return RemoveHiddenCopies(connection, ""); }));
  while (true) {
    // Other calls come between two steps.
    const MutexLock lock(&mutex_);
    HYPERMAP_ASSIGN_OR_RETURN(Connection* const catalog, Catalog());
    HYPERMAP_ASSIGN_OR_RETURN(const bool more, RemoveDeletedRows(catalog, kRowsPerStep));
    if (!more) return absl::OkStatus();
    HYPERMAP_RETURN_IF_ERROR(CheckCancelled());
  }
}

absl::StatusOr<std::optional<std::string>> PostgresStore::FindDeletion(
    const std::string& request_id) {
  std::optional<std::string> name;
  const absl::Status status = Change([&](Connection* connection) -> absl::Status {
    HYPERMAP_ASSIGN_OR_RETURN(name, postgres::FindDeletion(connection, request_id));
    return absl::OkStatus();
  });
  HYPERMAP_RETURN_IF_ERROR(status);
  return name;
}

absl::StatusOr<std::unique_ptr<LayerViews>> StartViews(Connection* connection,
                                                       const ConnectOptions& options) {
  HYPERMAP_RETURN_IF_ERROR(PrepareViewSchema(connection));
  return LayerViews::Start(options);
}

absl::StatusOr<std::unique_ptr<MapStore>> Open(const PostgresOptions& options) {
  const ConnectOptions connect = WriterOptionsOf(options);
  HYPERMAP_ASSIGN_OR_RETURN(std::unique_ptr<Connection> catalog, Connection::Open(connect));
  HYPERMAP_ASSIGN_OR_RETURN(const bool has_geometry, PrepareSchema(catalog.get()));
  auto guard = std::make_unique<DatabaseGuard>(options.server_id);
  HYPERMAP_RETURN_IF_ERROR(guard->Begin(catalog.get()));
  HYPERMAP_ASSIGN_OR_RETURN(
      std::unique_ptr<ServerLease> lease,
      ServerLease::Take({connect, options.server_id, options.lease, guard.get()}));
  HYPERMAP_ASSIGN_OR_RETURN(std::vector<std::string> notes, FindRisks(catalog.get()));
  HYPERMAP_RETURN_IF_ERROR(RemoveHiddenCopies(catalog.get(), options.server_id));
  std::unique_ptr<LayerViews> views;
  if (has_geometry) {
    absl::StatusOr<std::unique_ptr<LayerViews>> started = StartViews(catalog.get(), connect);
    if (started.ok()) {
      views = *std::move(started);
    } else {
      notes.push_back(
          absl::StrCat("layers have no views for other programs: ", started.status().message()));
    }
  }
  return std::make_unique<PostgresStore>(options, std::move(guard), std::move(catalog),
                                         std::move(lease), std::move(views), std::move(notes));
}

}  // namespace
}  // namespace postgres

absl::StatusOr<std::unique_ptr<MapStore>> OpenPostgresStore(const PostgresOptions& options) {
  PostgresOptions complete = options;
  if (complete.server_id.empty()) complete.server_id = absl::StrCat(absl::Hex(NewIncarnation()));
  HYPERMAP_RETURN_IF_ERROR(postgres::CheckServerId(complete.server_id));
  for (int attempt = 1;; ++attempt) {
    auto store = postgres::Open(complete);
    // A server that takes over the maps of an earlier process with this id ends all sessions of the
    // id, until this one has its lease (EndSessionsOfLostOwner).
    const bool was_ended = postgres::SqlStateOf(store.status()) == postgres::kSessionEnded;
    if (!was_ended || attempt == postgres::kOpenAttempts) return store;
  }
}

}  // namespace hypermap::storage
