// The bits of every quality of gpu/fit on eleven made elevation models and three places of a real one, as a GPU gave them.
#include <gtest/gtest.h>

#include <array>
#include <cstdlib>
#include <fstream>
#include <map>
#include <string>
#include <string_view>

#include "tests/bench/mesh_hash.h"
#include "tests/bench/quality/dems.h"

namespace cordillera {
namespace {

constexpr std::uint32_t kSide = 101, kFirst = 300;
constexpr double kCell_m = 30, kKeep = 0.1;
using Hashes = std::array<std::uint64_t, 5>;  // in the order of bench::ways()

// Recorded on 2026-11-21 on one NVIDIA H200 (CUDA 13.0, sm_90) by
//   quality_bench cuda --side 101 --first 300 --keep 0.1 --hash --terrain NAME
// and with --raw for the real places. A machine without a GPU checks its CPU against them; change them only with a run on a
// device.
const std::map<std::string, Hashes, std::less<>> kDeviceHashes{
    {"alpine", {0x131919c2b3cc4970, 0x3d6bbef467308770, 0x53f11534d53b20e6, 0x4672d78e28108679, 0xc6e36f6bca8fe49f}},
    {"rolling", {0xa9211de7d7202979, 0x3ce2f313811f8a7f, 0x32102e3f272fe8e3, 0xbb56c1b68519d823, 0x8406822388c209d1}},
    {"city", {0xf6ba996a3804f188, 0x2f78ecb880ca902e, 0x3f23a744513ed25e, 0xfd6da8f5626a4803, 0x24b12d2cf796b042}},
    {"islands", {0x78ac742c86d072ef, 0x6af91fa0acb1031e, 0xe56349977a819fb8, 0xfbee018cb4bc3845, 0xd8b1a16b7ca0c3eb}},
    {"noise", {0x62572cbce91ff70c, 0x7aa237b3e05056d5, 0xafe57414d4fe76d6, 0x0d5f190185ef9f7b, 0x471f1360f82d553f}},
    {"plane", {0x027d2f38b729c70d, 0x53eee871b277d050, 0x90274c8ff7b9c647, 0x2be264da897b6dd5, 0x5c265d1e5948b74e}},
    {"ridge", {0xe91f90aa9bf46f3f, 0xe91f90aa9bf46f3f, 0x1d1dd42844353d8b, 0xd08c04d74fc932da, 0xd08c04d74fc932da}},
    {"cliff", {0xb1fbc2f13be825d3, 0xb1fbc2f13be825d3, 0xe920553f8dc8d647, 0x386705c44ab22c3f, 0x386705c44ab22c3f}},
    {"faint", {0x498b3635224f17b2, 0x6f7941c8a514409e, 0x989161e97fb87682, 0xf59c283f393ab144, 0xa6ea9765204d3d94}},
    {"high", {0xd3c11bc91728ee6d, 0x1c2ecfcdd7f6283d, 0xf44cff4ffb283e17, 0x0182c69cb3b2f828, 0x4b2d03274a83f481}},
    {"extreme", {0xcaa5b6559795de53, 0xe83a6537cf53f753, 0x0094a7f7d4c0a1d5, 0x3470d2cec308ad6b, 0x53808e202c698ca7}},
    {"real0", {0xfe6fe727b6f7aefb, 0xa0c387ab10a17dc7, 0x60a8abf84adfa0a3, 0x284fa2eacbef1bc6, 0x747f040dc9fe9910}},
    {"real1", {0x9a908c821c622cb7, 0xe201e4d9b55b0b7a, 0x81a54fc7e823264d, 0x1f177783dc6cd4c4, 0x73ffc46ddea175ca}},
    {"real2", {0xd5308079452426af, 0x0537e6683b68e38e, 0xe876fc2622126c33, 0x86dde6f17ce14356, 0x0c6b952151f0a47c}},
};

class FitHashes : public testing::TestWithParam<std::string_view> {};

std::vector<float> made(std::string_view name) { return bench::dem_heights(name, kSide, kFirst); }

void expect_recorded(std::string_view name, const std::vector<float>& heights, const std::string& device, unsigned threads) {
  ASSERT_TRUE(kDeviceHashes.contains(name));
  const gpu::fit::HeightMesh mesh = bench::mesh_of(heights, kSide, kCell_m);
  const Hashes& hashes = kDeviceHashes.find(name)->second;
  std::size_t way_number = 0;
  for (const bench::Way& way : bench::ways(device, threads)) {
    const auto result = simplify(mesh, gpu::fit::MeshTarget::keep(kKeep), way.options);
    ASSERT_TRUE(result.ok()) << result.problem().line();
    EXPECT_EQ(result->report.device.substr(0, 3), device.substr(0, 3));  // a GPU that fails in mid-work is replaced
    EXPECT_EQ(bench::hash_of(result->mesh), hashes[way_number++])
        << name << ", " << way.name << ", " << device << ", threads " << threads;
  }
}

TEST_P(FitHashes, CpuGivesTheBitsOfTheDevice) { expect_recorded(GetParam(), made(GetParam()), "cpu", 1); }

TEST_P(FitHashes, CudaGivesThem) {
  const auto probe = simplify(bench::mesh_of(made("plane"), kSide, kCell_m), gpu::fit::MeshTarget::keep(0.5), {.device = "cuda"});
  if (!probe.ok()) GTEST_SKIP() << "no CUDA device: " << probe.problem().detail;
  expect_recorded(GetParam(), made(GetParam()), "cuda", 1);
}

INSTANTIATE_TEST_SUITE_P(Dems, FitHashes, testing::ValuesIn(bench::dem_names().begin(), bench::dem_names().end()),
                         [](const auto& name) { return std::string(name.param); });

TEST(FitHash, ThreadsDoNotShow) { expect_recorded("alpine", made("alpine"), "cpu", 3); }

/// Three places of an SRTM tile in the optional folder of test data: $CORDILLERA_TEST_DATA, else ../shared/dem beside the
/// checkout.
TEST(FitHash, RealTerrain) {
  constexpr std::uint32_t kAcross = 1201;
  const char* named = std::getenv("CORDILLERA_TEST_DATA");
  const std::string folder = named != nullptr ? named : CORDILLERA_SOURCE_DIR "/../shared/dem";
  std::ifstream file(folder + "/N44W072.hgt", std::ios::binary);
  if (!file) GTEST_SKIP() << "no test data in " << folder;
  std::vector<char> bytes(2 * kAcross * kAcross);
  file.read(bytes.data(), static_cast<std::streamsize>(bytes.size()));
  ASSERT_TRUE(file);
  // Big-endian, from the north-west.
  const auto metres = [&](std::uint32_t column, std::uint32_t row) {
    const std::size_t at = 2 * (std::size_t{kAcross - 1 - row} * kAcross + column);
    const auto byte = [&](std::size_t k) { return static_cast<unsigned>(static_cast<unsigned char>(bytes[at + k])); };
    return static_cast<float>(static_cast<std::int16_t>(byte(0) << 8 | byte(1)));
  };
  const std::array<std::array<std::uint32_t, 2>, 3> places{{{100, 150}, {700, 400}, {500, 900}}};
  for (std::size_t k = 0; k < places.size(); ++k) {
    std::vector<float> heights;
    for (std::uint32_t y = 0; y < kSide; ++y) {
      for (std::uint32_t x = 0; x < kSide; ++x) heights.push_back(metres(places[k][0] + x, places[k][1] + y));
    }
    expect_recorded("real" + std::to_string(k), heights, "cpu", 1);
  }
}

}  // namespace
}  // namespace cordillera
