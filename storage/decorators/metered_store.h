// A store whose operations are measured.
#ifndef HYPERMAP_STORAGE_DECORATORS_METERED_STORE_H_
#define HYPERMAP_STORAGE_DECORATORS_METERED_STORE_H_

#include <memory>

#include "storage/decorators/store_meters.h"
#include "storage/map_store.h"

namespace hypermap::storage {

// Hands everything to `store`. `meters` must outlive the store that is returned and its maps.
std::unique_ptr<MapStore> MakeMeteredStore(std::unique_ptr<MapStore> store, StoreMeters* meters);

}  // namespace hypermap::storage

#endif  // HYPERMAP_STORAGE_DECORATORS_METERED_STORE_H_
