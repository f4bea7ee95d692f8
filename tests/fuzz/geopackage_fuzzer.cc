// A map's file with any damage is opened as the server opens it, loaded, checked, and asked about
// its present, its past and its evidence. Each of these gives an answer or a documented error.
//
// An input chooses the damage that is done to the file of a small map, which the target makes
// itself: of bytes, or more often of rows (damage_file.h).
#include <fuzzer/FuzzedDataProvider.h>

#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <future>
#include <memory>
#include <string>
#include <utility>

#include "base/logging/log.h"
#include "map/query/query.h"
#include "server/session/map_session.h"
#include "server/session/testing/fused_site.h"
#include "storage/conformance/testing/edited_map.h"
#include "storage/geopackage/geopackage_store.h"
#include "storage/geopackage/testing/map.h"
#include "tests/fuzz/damage_file.h"
#include "tests/fuzz/require.h"
#include "tests/fuzz/scratch.h"
#include "tests/support/random_map.h"
#include "tests/support/temporary_folder.h"

namespace {

using namespace hypermap;          // NOLINT(google-build-using-namespace)
using namespace hypermap::server;  // NOLINT(google-build-using-namespace)

constexpr char kMap[] = "site";
constexpr char kFused[] = "things";

SessionOptions Options() {
  SessionOptions options;
  options.fusion.codec = WireEvidenceCodec();
  options.fusion.entries_per_stored_checkpoint = 2;
  options.max_group_time = absl::InfiniteDuration();
  return options;
}

// Opens the map of the file in the folder.
absl::StatusOr<std::unique_ptr<MapSession>> Open(storage::MapStore& store) {
  auto stored = store.Open(kMap);
  if (!stored.ok()) return stored.status();
  return MapSession::Start(*std::move(stored), Options());
}

// The file of a map with all kinds of layers, a few revisions, observations, a fact and
// checkpoints.
std::string MakeMap() {
  const hypermap::testing::TemporaryFolder folder;
  const auto store = storage::OpenStore(folder.path());
  REQUIRE(store->Create(storage::HeaderOf(kMap)).ok());
  const auto session = Open(*store);
  REQUIRE(session.ok());
  hypermap::testing::Rng rng(1);
  const auto edit = [&](EditBatch batch, const std::string& request_id) {
    REQUIRE((*session)->SubmitAndWait(Submission{std::move(batch), "test", request_id}).ok());
  };
  edit(hypermap::testing::RandomSite(rng, 8), "r1");
  edit(ThingsAndSeen(), "r2");
  const FusionSubmission start{StartFusion{kFused, {"", "", "seen"}}, "test", "r3"};
  REQUIRE((*session)->RunAndWait(start).ok());
  for (int64_t i = 1; i <= 6; ++i) {
    std::promise<Verdicts> verdicts;
    const Observation seen = Sighting("r", i, static_cast<double>(i), {"desk", "chair"});
    (*session)->Observe(ObservationSubmission{kFused, {seen}, "test"},
                        [&](Verdicts told) { verdicts.set_value(std::move(told)); });
    REQUIRE(verdicts.get_future().get().ok());
  }
  edit({{PutObject{kFused, storage::UnitSquare("table"), ""}}}, "r4");
  edit(hypermap::testing::RandomEdits(rng, *(*session)->snapshot()), "r5");
  (*session)->Close();
  return storage::ReadFile(folder / "site.gpkg");
}

void RequireDocumented(const absl::Status& status) {
  const bool documented = status.ok() || absl::IsDataLoss(status) ||
                          absl::IsFailedPrecondition(status) || absl::IsNotFound(status) ||
                          absl::IsOutOfRange(status) || absl::IsResourceExhausted(status);
  if (!documented) std::fprintf(stderr, "%s\n", status.ToString().c_str());
  REQUIRE(documented);
}

void AskPresent(const SnapshotPtr& snapshot) {
  const auto reader = ContentIn(snapshot, {}, Polygon::FromBox({{-20, -20}, {20, 20}}));
  REQUIRE(reader.ok());
  while (!(*reader)->done()) (*reader)->Next(1000);
  REQUIRE(ContentAt(*snapshot, {}, {0.5, 0.5}, 0.1).ok());
}

void AskPast(MapSession& session) {
  const auto history = session.OpenHistory();
  RequireDocumented(history.status());
  if (!history.ok()) return;
  const auto kept = (*history)->Kept();
  RequireDocumented(kept.status());
  if (!kept.ok()) return;
  RequireDocumented((*history)->Revisions(kept->oldest - 1, kept->newest + 1, true, 20).status());
  RequireDocumented((*history)->Commits(kept->oldest, 1000).status());
  for (Revision revision = kept->oldest; revision < kept->oldest + 2; ++revision) {
    const auto past = (*history)->At(revision);
    RequireDocumented(past.status());
    if (!past.ok()) continue;
    for (const auto& [name, layer] : (*past)->structure()->layers) {
      if (layer.spec.grid) {
        RequireDocumented((*past)->Tiles(name, kAllCells).status());
      } else {
        RequireDocumented((*past)->Objects(name).status());
        RequireDocumented((*past)->Objects(name, {{0, 0}, {5, 5}}).status());
      }
    }
  }
}

void AskEvidence(MapSession& session) {
  RequireDocumented(session.ReadEvidence(kFused, storage::BeforeAll(), 100).status());
  RequireDocumented(session.ReadEvidenceBase(kFused).status());
  // Folds from the newest checkpoint on.
  std::promise<absl::Status> answer;
  session.Observe(ObservationSubmission{kFused, {Sighting("r", 7, 7, {"desk"})}, "test"},
                  [&](Verdicts verdicts) { answer.set_value(verdicts.status()); });
  const absl::Status folded = answer.get_future().get();
  // A row that should not be there may make SQLite refuse the commit, which is INTERNAL.
  if (!absl::IsInternal(folded)) RequireDocumented(folded);
}

}  // namespace

extern "C" int LLVMFuzzerInitialize(int*, char***) {
  fuzz::KeepScratchInMemory();
  logging::Start(logging::Level::kOff, logging::Format::kText);
  return 0;
}

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  static const std::string& whole = *new std::string(MakeMap());
  if (size < 1) return 0;
  FuzzedDataProvider choices(data, size);
  const bool changes_rows = choices.ConsumeIntegralInRange(0, 3) > 0;
  const hypermap::testing::TemporaryFolder folder;
  const std::string path = folder / "site.gpkg";
  storage::WriteFile(path, changes_rows ? whole : fuzz::PatchBytes(whole, choices));
  if (changes_rows) fuzz::ChangeRows(path, choices);
  const auto store = storage::OpenStore(folder.path());
  const auto session = Open(*store);
  RequireDocumented(session.status());
  if (!session.ok()) return 0;
  AskPresent((*session)->snapshot());
  RequireDocumented((*session)->Check().status());
  AskPast(**session);
  AskEvidence(**session);
  return 0;
}
