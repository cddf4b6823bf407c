#include "tests/whole/bytes.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <utility>

#include "pipeline/store/store.h"

namespace cordillera::whole {

Bytes published(const std::string& path) {
  const auto store = pipeline::StoreReader::open(path);
  Bytes bytes;
  if (!store.ok()) {
    ADD_FAILURE() << store.problem().line();
    return bytes;
  }
  for (int z = 0; z <= static_cast<int>((*store)->manifest().max_level()); ++z) {
    for (const proto::TileRecord& record : (*store)->records(z, 0, 0, proto::tiles_across(z) - 1, proto::tiles_up(z) - 1)) {
      const proto::TileAddress at{z, static_cast<std::int32_t>(record.x()), static_cast<std::int32_t>(record.y())};
      bytes[{at, 0}] = (*store)->tile(at, pipeline::Encoding::drc)->bytes;
      bytes[{at, 1}] = (*store)->tile(at, pipeline::Encoding::glb)->bytes;
      bytes[{at, 2}] = record.SerializeAsString();
      if (std::string mask = (*store)->water(at); !mask.empty()) bytes[{at, 3}] = std::move(mask);
    }
  }
  return bytes;
}

std::size_t masks_in(const Bytes& bytes) {
  return static_cast<std::size_t>(
      std::count_if(bytes.begin(), bytes.end(), [](const auto& row) { return row.first.second == 3; }));
}

void expect_same(const Bytes& a, const Bytes& b) {
  EXPECT_GT(a.size(), 30u);
  ASSERT_EQ(a.size(), b.size());
  for (const auto& [key, bytes] : a) {
    const auto other = b.find(key);
    ASSERT_NE(other, b.end());
    EXPECT_TRUE(bytes == other->second) << key.first.z << "/" << key.first.x << "/" << key.first.y << ", face " << key.second;
  }
}

}  // namespace cordillera::whole
