#include "storage/encoding/tile_codec.h"

#include <bit>
#include <limits>

#include "base/cancellation/testing/cancelled_after.h"
#include "gtest/gtest.h"
#include "storage/encoding/tile_image.h"
#include "tests/support/random_map.h"

namespace hypermap::storage {
namespace {

using ::hypermap::testing::Rng;
using ::hypermap::testing::TestSeed;
using ::hypermap::testing::UniformInt;

constexpr LayerKind kGridKinds[] = {LayerKind::kOccupancy, LayerKind::kExploration,
                                    LayerKind::kScalar};

CellCode RandomCode(Rng& rng, LayerKind kind) {
  switch (kind) {
    case LayerKind::kOccupancy:
      return UniformInt(rng, 0, 10000);
    case LayerKind::kExploration:
      return UniformInt(rng, 0, 1);
    default:
      for (;;) {
        const float code = std::bit_cast<float>(static_cast<uint32_t>(rng()));
        if (code - code == 0) return code;
      }
  }
}

TileCodes Unknown() {
  TileCodes codes;
  codes.fill(kUnknownCode);
  return codes;
}

TileCodes RandomCodes(Rng& rng, LayerKind kind) {
  TileCodes codes = Unknown();
  for (CellCode& code : codes) {
    if (UniformInt(rng, 0, 3) != 0) code = RandomCode(rng, kind);
  }
  return codes;
}

absl::StatusOr<std::string> Encode(LayerKind kind, const TileCodes& codes) {
  return MakeTileCodec(kind)->Encode(*Tile::Make(codes));
}

class TileCodecTest : public ::testing::TestWithParam<LayerKind> {};

TEST_P(TileCodecTest, CancelledDecodingIsNotTakenForDamage) {
  const std::string image = *Encode(GetParam(), Unknown());
  const CancelledAfter cancelled(0);
  const auto tile = MakeTileCodec(GetParam())->Decode(image);
  EXPECT_TRUE(tile.ok()) << tile.status();
}

TEST_P(TileCodecTest, RandomTilesComeBackBitForBit) {
  const uint64_t seed = TestSeed();
  SCOPED_TRACE(::testing::Message() << "HYPERMAP_TEST_SEED=" << seed);
  Rng rng(seed);
  const auto codec = MakeTileCodec(GetParam());
  for (int i = 0; i < 10; ++i) {
    const TileCodes codes = RandomCodes(rng, GetParam());
    const auto image = Encode(GetParam(), codes);
    ASSERT_TRUE(image.ok()) << image.status();
    const auto decoded = codec->Decode(*image);
    ASSERT_TRUE(decoded.ok()) << decoded.status();
    const TileCodes decoded_codes = (*decoded)->codes();
    for (size_t c = 0; c < codes.size(); ++c) {
      const CellCode expected = codes[c];
      const CellCode actual = decoded_codes[c];
      ASSERT_TRUE(IsUnknown(expected)
                      ? IsUnknown(actual)
                      : std::bit_cast<uint32_t>(expected) == std::bit_cast<uint32_t>(actual))
          << expected << " became " << actual;
    }
  }
}

TEST_P(TileCodecTest, EveryCutIsDamageOrTheSameTile) {
  Rng rng(5);
  const auto codec = MakeTileCodec(GetParam());
  const std::string image = *Encode(GetParam(), RandomCodes(rng, GetParam()));
  for (size_t size = 0; size < image.size(); size += size < 200 ? 1 : 97) {
    const auto decoded = codec->Decode(image.substr(0, size));
    EXPECT_EQ(decoded.status().code(), absl::StatusCode::kDataLoss) << size;
  }
}

TEST_P(TileCodecTest, FlippedBytesNeverCrash) {
  const uint64_t seed = TestSeed();
  SCOPED_TRACE(::testing::Message() << "HYPERMAP_TEST_SEED=" << seed);
  Rng rng(seed);
  const auto codec = MakeTileCodec(GetParam());
  const std::string image = *Encode(GetParam(), RandomCodes(rng, GetParam()));
  for (int i = 0; i < 500; ++i) {
    std::string damaged = image;
    // Headers decide most, so half of the flips go there.
    const int last = i % 2 == 0 ? 63 : static_cast<int>(image.size()) - 1;
    for (int flips = 0; flips < 3; ++flips) {
      damaged[UniformInt(rng, 0, last)] = static_cast<char>(rng());
    }
    if (i % 3 == 0) {  // the TIFF's directory stands at the end
      damaged[image.size() - UniformInt(rng, 1, 150)] = static_cast<char>(rng());
    }
    const auto decoded = codec->Decode(damaged);
    if (!decoded.ok()) {
      EXPECT_EQ(decoded.status().code(), absl::StatusCode::kDataLoss);
    }
  }
}

INSTANTIATE_TEST_SUITE_P(Kinds, TileCodecTest, ::testing::ValuesIn(kGridKinds));

TEST(TileCodecTest, TopRowOfTheImageIsTheHighestRowOfCells) {
  TileCodes codes = Unknown();
  codes[CellInTile(0, 0)] = 1;
  codes[CellInTile(kTileSide - 1, 2)] = 3;
  const std::string image = *Encode(LayerKind::kOccupancy, codes);
  TileImage<uint16_t> pixels;
  ASSERT_TRUE(DecodePng(image, &pixels).ok());
  EXPECT_EQ(pixels[(kTileSide - 1) * kTileSide], 1);
  EXPECT_EQ(pixels[2], 3);
  EXPECT_EQ(pixels[0], 65535);
}

TEST(TileCodecTest, CodesThatTheKindDoesNotHaveAreNotWritten) {
  const auto encode = [](LayerKind kind, CellCode code) {
    TileCodes codes = Unknown();
    codes[CellInTile(7, 7)] = code;
    return Encode(kind, codes).status().code();
  };
  EXPECT_EQ(encode(LayerKind::kOccupancy, 10001), absl::StatusCode::kInternal);
  EXPECT_EQ(encode(LayerKind::kOccupancy, -1), absl::StatusCode::kInternal);
  EXPECT_EQ(encode(LayerKind::kOccupancy, 0.5), absl::StatusCode::kInternal);
  EXPECT_EQ(encode(LayerKind::kExploration, 2), absl::StatusCode::kInternal);
  EXPECT_EQ(encode(LayerKind::kScalar, std::numeric_limits<float>::infinity()),
            absl::StatusCode::kInternal);
}

TEST(TileCodecTest, PixelsThatTheKindDoesNotHaveAreDamage) {
  TileImage<uint16_t> pixels{};
  pixels[5] = 10001;
  EXPECT_EQ(MakeTileCodec(LayerKind::kOccupancy)->Decode(*EncodePng(pixels)).status().code(),
            absl::StatusCode::kDataLoss);
  pixels[5] = 2;
  EXPECT_EQ(MakeTileCodec(LayerKind::kExploration)->Decode(*EncodePng(pixels)).status().code(),
            absl::StatusCode::kDataLoss);
  TileImage<float> floats{};
  floats[5] = std::numeric_limits<float>::infinity();
  EXPECT_EQ(MakeTileCodec(LayerKind::kScalar)->Decode(*EncodeTiff(floats)).status().code(),
            absl::StatusCode::kDataLoss);
}

TEST(TileCodecTest, SemanticLayersHaveNone) {
  EXPECT_EQ(MakeTileCodec(LayerKind::kSemantic), nullptr);
}

}  // namespace
}  // namespace hypermap::storage
