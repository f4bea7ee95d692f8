#include "tests/bench/server/edit_calls.h"

#include "absl/strings/str_cat.h"
#include "hypermap/v1/edit_service.pb.h"
#include "tests/bench/server/map_files.h"
#include "wire/geometry.h"

namespace hypermap::bench {

SemanticObject EditedObject(const GeneratedSite& site, int64_t n) {
  // Multiples of a large odd number visit the whole site in no apparent order.
  const auto index = static_cast<int64_t>((static_cast<uint64_t>(n) * 0x9E3779B97F4A7C15ULL >> 1) %
                                          static_cast<uint64_t>(site.num_objects()));
  return site.Object(index);
}

Calls EditCalls(const GeneratedSite& site, std::atomic<int64_t>* counter) {
  Calls calls;
  calls.method = "/hypermap.v1.EditService/ApplyEdits";
  calls.request = [site, counter](int64_t) {
    const int64_t n = counter->fetch_add(1);
    const SemanticObject object = EditedObject(site, n);
    v1::ApplyEditsRequest request;
    request.set_map(kSiteMap);
    request.set_request_id(absl::StrCat("bench-request-of-some-length-", n));
    v1::PutObject* const put = request.add_edits()->mutable_put_object();
    put->set_layer(kObjectsLayer);
    put->mutable_object()->set_label(object.label);
    put->mutable_object()->set_existence(object.existence);
    wire::EncodeShape(object.shape, put->mutable_object()->mutable_shape());
    return ToBytes(request);
  };
  return calls;
}

}  // namespace hypermap::bench
