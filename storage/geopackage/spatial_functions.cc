#include "storage/geopackage/spatial_functions.h"

#include "absl/status/statusor.h"
#include "absl/strings/str_cat.h"
#include "base/status/status_macros.h"
#include "storage/encoding/geometry_blob.h"

namespace hypermap::storage {
namespace {

absl::StatusOr<Box> BoxOfArgument(sqlite3_value* value) {
  if (sqlite3_value_type(value) != SQLITE_BLOB) return absl::InvalidArgumentError("no geometry");
  const auto* bytes = static_cast<const char*>(sqlite3_value_blob(value));
  return BoxOfGeometryBlob({bytes, static_cast<size_t>(sqlite3_value_bytes(value))});
}

void IsEmpty(sqlite3_context* context, int, sqlite3_value** arguments) {
  const absl::StatusOr<Box> box = BoxOfArgument(arguments[0]);
  if (box.ok()) sqlite3_result_int(context, box->empty() ? 1 : 0);
}

template <Point Box::*corner, double Point::*axis>
void Bound(sqlite3_context* context, int, sqlite3_value** arguments) {
  const absl::StatusOr<Box> box = BoxOfArgument(arguments[0]);
  if (box.ok() && !box->empty()) sqlite3_result_double(context, (*box).*corner.*axis);
}

using Function = void (*)(sqlite3_context*, int, sqlite3_value**);

absl::Status Register(Database* database, const char* name, Function function) {
  const int flags = SQLITE_UTF8 | SQLITE_DETERMINISTIC | SQLITE_INNOCUOUS;
  const int code = sqlite3_create_function_v2(database->handle(), name, 1, flags, nullptr, function,
                                              nullptr, nullptr, nullptr);
  if (code == SQLITE_OK) return absl::OkStatus();
  return absl::InternalError(absl::StrCat("cannot register ", name));
}

}  // namespace

absl::Status RegisterSpatialFunctions(Database* database) {
  const struct {
    const char* name;
    Function function;
  } functions[] = {{"ST_IsEmpty", IsEmpty},
                   {"ST_MinX", Bound<&Box::min, &Point::x>},
                   {"ST_MaxX", Bound<&Box::max, &Point::x>},
                   {"ST_MinY", Bound<&Box::min, &Point::y>},
                   {"ST_MaxY", Bound<&Box::max, &Point::y>}};
  for (const auto& [name, function] : functions) {
    HYPERMAP_RETURN_IF_ERROR(Register(database, name, function));
  }
  return absl::OkStatus();
}

}  // namespace hypermap::storage
