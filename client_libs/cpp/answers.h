// Answers of a Hypermap server as plain values of the domain.
#ifndef HYPERMAP_CLIENT_LIBS_CPP_ANSWERS_H_
#define HYPERMAP_CLIENT_LIBS_CPP_ANSWERS_H_

#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "absl/time/time.h"
#include "base/identity/role.h"
#include "map/check_report.h"
#include "map/digest/content_digest.h"
#include "map/entries.h"
#include "map/frames/frame_tree.h"
#include "map/objects/semantic_object.h"
#include "map/query/answers.h"
#include "map/registration/point_pairs.h"
#include "map/registration/transform_answer.h"
#include "map/server_list.h"
#include "map/snapshot.h"
#include "map/watch/map_change.h"

namespace hypermap::client {

using hypermap::CheckReport;
using hypermap::Finding;
using hypermap::LayerEntry;
using hypermap::MapEntry;
using hypermap::RevisionRecord;
using hypermap::ServerList;

// Who the caller is to the server, and what it may do.
struct CallerAnswer {
  // True if the server knows identities. If not, everybody may do everything, and the rest is
  // empty.
  bool has_identities = false;
  std::string identity;  // the author of the caller's changes
  access::Role role = access::Role::kReader;
  std::vector<std::string> maps;    // patterns of the maps for which it has the role
  std::vector<std::string> robots;  // patterns of the robots, besides itself, that it may act for
  absl::Time expires = absl::InfiniteFuture();  // of its token
};

// What the server shows of a map at a revision, as digests.
struct DigestAnswer {
  std::string map;
  ContentDigest digest;
  // By layer: the newest revision that changed the layer or its content.
  std::map<std::string, Revision> layer_versions;
  uint64_t incarnation = 0;  // of the map to which the revision belongs
};

struct LayerList {
  std::string map;
  Revision revision = 0;
  std::vector<LayerEntry> layers;  // sorted by name
  uint64_t incarnation = 0;        // of the map to which the revision belongs, here and below
};

struct TransformList {
  std::string map;
  Revision revision = 0;
  std::string frame_id;                    // the map's own
  std::vector<FrameTransform> transforms;  // sorted by child
  uint64_t incarnation = 0;
};

// The base name and the bytes of a file.
struct NamedFile {
  std::string name;
  std::string data;
};

struct ImportAnswer {
  std::string map;
  Revision revision = 0;
  std::vector<std::string> layers;  // created or written
  // Deviations from the file format that were repaired, and how each was read.
  std::vector<std::string> repairs;
  uint64_t incarnation = 0;
};

struct ExportAnswer {
  std::string map;
  Revision revision = 0;
  std::vector<NamedFile> files;
  std::vector<std::string> omissions;  // parts of the map that the format can't represent
  uint64_t incarnation = 0;
};

struct EditAnswer {
  std::string map;
  Revision revision = 0;
  // One for each edit: the id of the object for PutObject, otherwise 0.
  std::vector<ObjectId> object_ids;
  uint64_t incarnation = 0;
};

using answers::LayerContent;
using answers::LayerPart;
using answers::LayerRefusal;
using answers::NearestAnswer;
using answers::NearestMatch;
using answers::PointAnswer;

using registration::NamedPair;
using registration::TransformAnswer;

// Objects and cells are in the requested frame; caller_from_layer is the identity.
using hypermap::MapChange;

// The answer of SmoothPoses.
struct SmoothingAnswer {
  Revision revision = 0;        // shows the new poses; the newest one if nothing was moved
  int64_t matched = 0;          // observations whose surfaces were looked at
  int64_t moved = 0;            // observations that are shown elsewhere now
  double rms_shift_m = 0.0;     // of those: between the poses that robots told and the new ones
  std::string occupancy_layer;  // whose walls were used; empty if none were
};

struct RevisionList {
  std::string map;
  Revision newest = 0;
  Revision oldest = 0;  // the oldest that can be queried
  std::vector<RevisionRecord> revisions;
  uint64_t incarnation = 0;
};

}  // namespace hypermap::client

#endif  // HYPERMAP_CLIENT_LIBS_CPP_ANSWERS_H_
