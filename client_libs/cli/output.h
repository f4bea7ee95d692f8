// Prints the answers of commands: as JSON for programs or as tables for people.
#ifndef HYPERMAP_CLIENT_LIBS_CLI_OUTPUT_H_
#define HYPERMAP_CLIENT_LIBS_CLI_OUTPUT_H_

#include <map>
#include <optional>
#include <string>
#include <vector>

#include "base/access/access_table.h"
#include "client_libs/bench/report.h"
#include "client_libs/cpp/answers.h"
#include "client_libs/cpp/exploration_answers.h"
#include "client_libs/cpp/ingest_answers.h"
#include "client_libs/cpp/points_stream.h"
#include "client_libs/cpp/robots.h"
#include "client_libs/cpp/watch.h"
#include "map/evaluation/evaluate.h"
#include "map/frames/frame_tree.h"
#include "storage/transfer/migration.h"

namespace hypermap::cli {

// The effect of a mutation that has no answer of its own.
struct Done {
  std::string map;
  std::string what;       // "created", "deleted", ...
  std::string layer;      // or empty
  Revision revision = 0;  // 0: none
};

// Files that a command wrote.
struct WrittenFiles {
  std::string map;
  Revision revision = 0;  // 0: not known
  std::vector<std::string> paths;
  std::vector<std::string> omissions;
};

// A stored map that was checked, and perhaps repaired.
struct CheckedMap {
  std::string name;  // or path
  client::CheckReport report;
  int64_t num_repaired = 0;  // findings that a repair has removed
  // Rows that were fetched from another copy of the map, by layer.
  std::map<std::string, std::vector<std::string>> fetched = {};
  std::string copy;  // the path of the file as it was before a repair, or empty
};

// A map that was to be copied to another store.
struct MigratedMap {
  storage::Migration migration;
  std::string problem;  // why it was not; or empty
};

// The comparison of a layer with the ground truth.
struct EvaluationReport {
  std::string map;
  std::string layer;
  Revision revision = 0;
  std::string truth;      // file or layer
  int truth_ignored = 0;  // not detectable, or visible in too few frames
  // Number of line strings and points, which are left out because they have no area to compare.
  int truth_not_polygons = 0;
  int map_not_polygons = 0;
  std::string image;  // the path of the picture, or empty
  evaluation::Evaluation evaluation;
};

// A picture that was written.
struct RenderReport {
  std::string map;
  Revision revision = 0;
  std::string path;
  int width = 0;  // pixels
  int height = 0;
  std::vector<std::string> layers;             // drawn
  std::vector<client::LayerRefusal> refusals;  // layers that can't be drawn
  int64_t objects = 0;
};

// A transform between two maps that was estimated.
struct TransformReport {
  client::TransformAnswer answer;
  std::vector<client::NamedPair> pairs;  // from which it was estimated, if any
  std::string image;                     // the path of the picture, or empty
  // The transform that was set in the target's map, and the revision that did it; if it was.
  std::optional<FrameTransform> applied;
  Revision applied_revision = 0;
};

// An exploration that was started, read or stopped.
struct ExplorationReport {
  std::string map;
  Revision revision = 0;  // 0: not known
  client::ExplorationEntry entry;
  std::optional<client::ExplorationProgress> progress;  // only of one that was read
};

struct ExplorationsReport {
  std::string map;
  client::ExplorationList list;
};

struct FrontiersReport {
  std::string map;
  client::FrontierList list;
};

// The robots of a map that have reported where they are.
struct RobotsReport {
  std::string map;
  client::RobotList list;
};

// A token that was made. This is the only time that its text is known.
struct CreatedToken {
  std::string identity;
  std::string id;
  std::string text;
  absl::Time expires;
};

struct RevokedToken {
  std::string id;
};

// A server that may own maps, or is drained.
struct ServerState {
  std::string id;
  bool draining = false;
};

// A change between two revisions.
struct DifferenceChange {
  Revision revision = 0;           // the later one
  std::optional<absl::Time> time;  // when that revision was made
  client::MapChange change;
};

// Prints the answer of one command. Used by one thread.
class Output {
 public:
  virtual ~Output() = default;

  virtual void Show(const std::vector<client::MapEntry>& maps) = 0;
  virtual void Show(const client::LayerList& layers) = 0;
  virtual void Show(const client::TransformList& transforms) = 0;
  virtual void Show(const client::ImportAnswer& answer) = 0;
  virtual void Show(const WrittenFiles& files) = 0;
  virtual void Show(const Done& done) = 0;
  virtual void Show(const client::CallerAnswer& caller) = 0;
  virtual void Show(const client::ServerList& list) = 0;
  virtual void Show(const ServerState& server) = 0;
  virtual void Show(const std::vector<CheckedMap>& maps) = 0;
  virtual void Show(const client::DigestAnswer& answer) = 0;
  virtual void Show(const std::vector<MigratedMap>& maps) = 0;
  // A table prints nothing but the token, so that a script can take it.
  virtual void Show(const CreatedToken& token) = 0;
  virtual void Show(const RevokedToken& token) = 0;
  virtual void Show(const std::vector<access::IdentityRecord>& identities) = 0;
  virtual void Show(const client::PointAnswer& answer) = 0;
  virtual void Show(const client::NearestAnswer& answer) = 0;

  // Prints the answer to a batch of points, a line for each; EndPoints follows the last batch.
  // Flush writes what was printed.
  virtual void Show(const std::vector<Point>& points, const client::PointsAnswer& answer) = 0;
  virtual void EndPoints(Revision revision) = 0;
  virtual void Flush() = 0;

  virtual void Show(const client::ObjectHistory& history) = 0;
  virtual void Show(const EvaluationReport& report) = 0;
  virtual void Show(const RenderReport& report) = 0;
  virtual void Show(const TransformReport& report) = 0;
  virtual void Show(const ExplorationReport& report) = 0;
  virtual void Show(const ExplorationsReport& report) = 0;
  virtual void Show(const FrontiersReport& report) = 0;
  virtual void Show(const RobotsReport& report) = 0;
  virtual void Show(const client::RevisionList& revisions) = 0;
  virtual void Show(const bench::FleetReport& report) = 0;

  // Prints a revision of a watch, and flushes it.
  virtual void Show(const client::WatchEvent& event) = 0;

  // Prints a line for each robot that has changed or was forgotten, and flushes them.
  virtual void Show(const client::RobotChanges& changes) = 0;

  // Prints the changes of a difference as they arrive. EndDifference follows the last one.
  virtual void Show(const DifferenceChange& change) = 0;
  virtual void EndDifference(Revision from, Revision to) = 0;

  // Prints the parts of an area or value answer as they arrive. EndParts follows the last one, but
  // not if the answer breaks off; the output up to there consists of whole lines.
  virtual void Show(const client::LayerPart& part) = 0;
  virtual void EndParts(Revision revision) = 0;
};

}  // namespace hypermap::cli

#endif  // HYPERMAP_CLIENT_LIBS_CLI_OUTPUT_H_
