// Any bytes decode to an observation of a log, to an object of an operator's fact, or to DATA_LOSS.
// A decoded value is encoded, and decodes the same, also from the bytes that version 0.1 made of
// it. An entry of a log is decoded only if its body has the entry's key.
//
// The first byte of an input chooses between observation and object.
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <string>

#include "hypermap/v1/object.pb.h"
#include "hypermap/v1/observation.pb.h"
#include "server/fusion/evidence.h"
#include "server/services/evidence_codec.h"
#include "tests/fuzz/mutate_message.h"
#include "tests/fuzz/require.h"

namespace {

using namespace hypermap;  // NOLINT(google-build-using-namespace)

const server::EvidenceCodec& Codec() {
  static const server::EvidenceCodec& codec =
      *new server::EvidenceCodec(server::WireEvidenceCodec());
  return codec;
}

bool IsOkOrDataLoss(const absl::Status& status) { return status.ok() || absl::IsDataLoss(status); }

void CheckObservation(absl::string_view bytes) {
  const auto observation = Codec().decode_observation(bytes);
  REQUIRE(IsOkOrDataLoss(observation.status()));
  if (!observation.ok()) return;
  const std::string encoded = Codec().encode_observation(*observation);
  for (const std::string& stored : {encoded, Codec().encode_observation_01(*observation)}) {
    const auto again = Codec().decode_observation(stored);
    REQUIRE(again.ok());
    REQUIRE(Codec().encode_observation(*again) == encoded);
  }
  storage::LogEntry entry{{KeyOf(*observation), 0}, "", "", encoded};
  REQUIRE(server::DecodeEvidence(entry, Codec()).ok());
  entry.key.after.sequence ^= 1;
  REQUIRE(absl::IsDataLoss(server::DecodeEvidence(entry, Codec()).status()));
}

void CheckObject(absl::string_view bytes) {
  const auto object = Codec().decode_object(bytes);
  REQUIRE(IsOkOrDataLoss(object.status()));
  if (!object.ok()) return;
  const std::string encoded = Codec().encode_object(*object);
  const auto again = Codec().decode_object(encoded);
  REQUIRE(again.ok());
  REQUIRE(Codec().encode_object(*again) == encoded);
  for (const char* kind : {"pin", "remove"}) {
    const storage::LogEntry entry{{{}, 1}, kind, "r/1/0", encoded};
    const auto evidence = server::DecodeEvidence(entry, Codec());
    REQUIRE(evidence.ok());
    const storage::LoggedFact fact = server::EncodeFact(entry.key, *evidence->fact, Codec());
    REQUIRE(fact.kind == kind && fact.track == entry.track && fact.body == encoded);
  }
}

}  // namespace

extern "C" size_t LLVMFuzzerCustomMutator(uint8_t* data, size_t size, size_t max_size,
                                          unsigned seed) {
  if (size < 1 || max_size < 2) return LLVMFuzzerMutate(data, size, max_size);
  v1::Observation observation;
  v1::Object object;
  google::protobuf::Message* const message =
      (data[0] & 1) != 0 ? static_cast<google::protobuf::Message*>(&object) : &observation;
  return 1 + fuzz::MutateBytes(message, data + 1, size - 1, max_size - 1, seed);
}

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  if (size < 1) return 0;
  const absl::string_view bytes(reinterpret_cast<const char*>(data) + 1, size - 1);
  if ((data[0] & 1) != 0) {
    CheckObject(bytes);
  } else {
    CheckObservation(bytes);
  }
  return 0;
}
