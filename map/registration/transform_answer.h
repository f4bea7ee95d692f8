// A transform that was estimated between two maps, as a plain value. Clients receive it in this
// form.
#ifndef HYPERMAP_MAP_REGISTRATION_TRANSFORM_ANSWER_H_
#define HYPERMAP_MAP_REGISTRATION_TRANSFORM_ANSWER_H_

#include <cstdint>
#include <string>

#include "map/registration/transform_estimate.h"
#include "map/snapshot.h"

namespace hypermap::registration {

// What was read of a map.
struct ReadSide {
  std::string map;
  std::string layer;  // empty for an estimate from pairs of points
  std::string frame_id;
  Revision revision = 0;
  uint64_t incarnation = 0;  // of the map to which the revision belongs

  friend bool operator==(const ReadSide&, const ReadSide&) = default;
};

struct TransformAnswer {
  ReadSide source;
  ReadSide target;
  // From the frame of `source` to that of `target`.
  TransformEstimate estimate;
};

}  // namespace hypermap::registration

#endif  // HYPERMAP_MAP_REGISTRATION_TRANSFORM_ANSWER_H_
