// The statements that write the log of evidence.
#ifndef HYPERMAP_STORAGE_POSTGRES_FUSION_CHANGES_H_
#define HYPERMAP_STORAGE_POSTGRES_FUSION_CHANGES_H_

#include <cstdint>
#include <string>

#include "storage/fusion_log.h"
#include "storage/libpq/connection.h"

namespace hypermap::storage::postgres {

// Sends the statements of a change, within a transaction of the caller. The pipeline fails with
// INTERNAL if the change retracts an observation that is not there.
void AddFusionChange(Pipeline& pipeline, int64_t map, const FusionChange& change);

// Sends the statements that remove all of a layer.
void DropFusion(Pipeline& pipeline, int64_t map, const std::string& layer);
// Sends those that remove all of all layers.
void DropAllFusion(Pipeline& pipeline, int64_t map);

}  // namespace hypermap::storage::postgres

#endif  // HYPERMAP_STORAGE_POSTGRES_FUSION_CHANGES_H_
