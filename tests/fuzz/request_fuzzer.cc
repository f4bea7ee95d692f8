// Any sequence of calls to a server is answered with documented statuses: none is INTERNAL, UNKNOWN
// or DATA_LOSS. A refused call leaves the revision of its map unchanged. At the end the map still
// answers a query of its whole content.
//
// An input is a message Calls (calls.proto) in text format. Each begins with a new small map in
// memory, and the calls go to one server over a connection, as those of any client.
#include <grpcpp/create_channel.h>
#include <grpcpp/security/credentials.h>

#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <memory>
#include <string>
#include <utility>

#include "absl/strings/match.h"
#include "absl/strings/string_view.h"
#include "base/logging/log.h"
#include "server/services/evidence_codec.h"
#include "server/services/grpc_server.h"
#include "server/session/site.h"
#include "server/session/testing/memory_map_store.h"
#include "tests/fuzz/calls.pb.h"
#include "tests/fuzz/generic_calls.h"
#include "tests/fuzz/mutate_message.h"
#include "tests/fuzz/require.h"
#include "tests/fuzz/scratch.h"
#include "tests/support/temporary_folder.h"

namespace {

using namespace hypermap;          // NOLINT(google-build-using-namespace)
using namespace hypermap::server;  // NOLINT(google-build-using-namespace)

constexpr char kMap[] = "site";

// Small limits, so that a fuzzer reaches them, and so that no call takes long.
Limits SmallLimits() {
  Limits limits;
  limits.max_message_bytes = 1 << 20;
  limits.max_vertices = 500;
  limits.max_edits = 50;
  limits.max_layers = 10;
  limits.max_cells = 1 << 15;
  limits.max_nearest = 20;
  limits.max_points = 50;
  limits.max_exploration_cells = 1 << 14;
  limits.max_maps = 4;
  limits.max_import_bytes = 1 << 18;
  limits.max_unpacked_bytes = 1 << 18;
  limits.max_archive_members = 20;
  limits.max_import_objects = 100;
  limits.chunk_items = 5;
  return limits;
}

// A layer of objects, a fused layer, a grid of each kind, and frames.
EditBatch SmallMap() {
  EditBatch batch;
  const auto create = [&](const char* name, LayerKind kind, const char* frame) {
    LayerSpec spec;
    spec.name = name;
    spec.kind = kind;
    spec.frame_id = frame;
    if (kind != LayerKind::kSemantic) spec.grid = GridGeometry{PlanarTransform(), 0.5};
    batch.edits.push_back(CreateLayer{std::move(spec)});
  };
  batch.edits.push_back(SetTransform{{"map", "dock", PlanarTransform(1, 2, 0.5)}});
  create("objects", LayerKind::kSemantic, "map");
  create("things", LayerKind::kSemantic, "dock");
  create("occupancy", LayerKind::kOccupancy, "dock");
  create("seen", LayerKind::kExploration, "map");
  create("scalar", LayerKind::kScalar, "map");
  for (int i = 0; i < 3; ++i) {
    SemanticObject cup{.label = "cup", .shape = Polygon::FromBox({{2.0 * i, 0}, {2.0 * i + 1, 1}})};
    batch.edits.push_back(PutObject{"objects", cup, ""});
  }
  for (const char* grid : {"occupancy", "seen", "scalar"}) {
    batch.edits.push_back(WriteCells{grid, {0, 2, 0, 2}, {0.0, 1.0, std::nullopt, 1.0}});
  }
  return batch;
}

class Server {
 public:
  Server() {
    SessionOptions options;
    options.limits = SmallLimits();
    options.fusion.codec = WireEvidenceCodec();
    site_ = *Site::Open(std::make_unique<MemoryMapStore>(&disk_), options);
    server_ = *GrpcServer::Start(
        {"127.0.0.1:0", SmallLimits().max_message_bytes},
        {site_.get(), SmallLimits(), &workers_, scratch_.path(), &budgets_, &access_, &meters_});
    calls_ = std::make_unique<fuzz::GenericCalls>(
        grpc::CreateChannel(server_->address(), grpc::InsecureChannelCredentials()));
  }

  // Removes all maps, and makes the small one.
  void Reset() {
    for (const Site::Entry& entry : site_->List()) {
      REQUIRE(site_->Delete(entry.name, "").ok());
    }
    const auto made = site_->CreateFilled({kMap, "map", ""}, [](MapSession& session) {
      const absl::Status filled =
          session.SubmitAndWait(Submission{SmallMap(), "test", ""}).status();
      if (!filled.ok()) return filled;
      return session
          .RunAndWait(FusionSubmission{StartFusion{"things", {"", "", "seen"}}, "test", ""})
          .status();
    });
    if (!made.ok()) std::fprintf(stderr, "%s\n", made.status().ToString().c_str());
    REQUIRE(made.ok());
  }

  grpc::Status Make(const fuzz::Call& call) { return calls_->Make(call); }

  // The revision of the small map; -1 if it is gone.
  Revision revision() const {
    const auto session = site_->Find(kMap);
    return session.ok() ? (*session)->snapshot()->revision : -1;
  }

 private:
  hypermap::testing::TemporaryFolder scratch_;
  MemoryDisk disk_;
  Budgets budgets_{SmallLimits()};
  AccessControl access_;
  RpcMeters meters_;
  std::unique_ptr<Site> site_;
  WorkerPools workers_{2};
  std::unique_ptr<GrpcServer> server_;
  std::unique_ptr<fuzz::GenericCalls> calls_;
};

bool IsDocumented(const grpc::Status& status) {
  switch (status.error_code()) {
    case grpc::StatusCode::INTERNAL:
    case grpc::StatusCode::UNKNOWN:
    case grpc::StatusCode::DATA_LOSS:
      return false;
    default:
      return true;
  }
}

// Returns whether the call has ended, so that no later call sees its effect. `expires`: objects may
// expire at any time, each with a revision of its own.
bool CheckCall(Server& server, const fuzz::Call& call, bool expires) {
  const Revision before = server.revision();
  const grpc::Status status = server.Make(call);
  if (!IsDocumented(status)) {
    std::fprintf(stderr, "%s: %d %s\n", call.ShortDebugString().c_str(), status.error_code(),
                 status.error_message().c_str());
  }
  REQUIRE(IsDocumented(status));
  if (status.error_code() == grpc::StatusCode::DEADLINE_EXCEEDED) return false;
  // The observations of a stream are judged one by one.
  const bool refused = !status.ok() && !call.has_observe();
  REQUIRE(!refused || expires || server.revision() == before);
  return true;
}

// A query of everything in the small map.
fuzz::Call QueryOfAll() {
  fuzz::Call call;
  v1::QueryAreaRequest& request = *call.mutable_query_area();
  request.mutable_scope()->set_map(kMap);
  for (const auto& [x, y] :
       {std::pair{-9, -9}, std::pair{9, -9}, std::pair{9, 9}, std::pair{-9, 9}}) {
    request.mutable_area()->mutable_outer()->add_xs(x);
    request.mutable_area()->mutable_outer()->add_ys(y);
  }
  return call;
}

}  // namespace

extern "C" int LLVMFuzzerInitialize(int*, char***) {
  fuzz::KeepScratchInMemory();
  logging::Start(logging::Level::kOff, logging::Format::kText);
  return 0;
}

extern "C" size_t LLVMFuzzerCustomMutator(uint8_t* data, size_t size, size_t max_size,
                                          unsigned seed) {
  fuzz::Calls calls;
  return fuzz::MutateText(&calls, data, size, max_size, seed);
}

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  constexpr int kMaxCalls = 10;
  fuzz::Calls calls;
  if (!fuzz::ParseText(data, size, &calls) || calls.calls_size() > kMaxCalls) return -1;
  static Server& server = *new Server();
  server.Reset();
  const absl::string_view text(reinterpret_cast<const char*>(data), size);
  const bool expires = absl::StrContains(text, "time_to_live");
  for (const fuzz::Call& call : calls.calls()) {
    if (!CheckCall(server, call, expires)) return 0;
  }
  if (server.revision() >= 0) REQUIRE(server.Make(QueryOfAll()).ok());
  return 0;
}
