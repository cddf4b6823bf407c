#include "pipeline/exports/pmtiles_directory.h"

#include <algorithm>

#include "pipeline/exports/gzip.h"

namespace cordillera::pipeline::exports {
namespace {

void append_varint(std::string& out, std::uint64_t value) {
  for (; value >= 128; value >>= 7) out.push_back(static_cast<char>((value & 127) | 128));
  out.push_back(static_cast<char>(value));
}

/// Column by column, for equal neighbours compress best.
std::string directory(std::span<const PmtilesEntry> entries) {
  std::string out;
  append_varint(out, entries.size());
  std::uint64_t last = 0;
  for (const PmtilesEntry& e : entries) {
    append_varint(out, e.id - last);
    last = e.id;
  }
  for (const PmtilesEntry& e : entries) append_varint(out, e.run);
  for (const PmtilesEntry& e : entries) append_varint(out, e.length);
  for (std::size_t i = 0; i < entries.size(); ++i) {
    const bool goes_on = i > 0 && entries[i].offset == entries[i - 1].offset + entries[i - 1].length;
    append_varint(out, goes_on ? 0 : entries[i].offset + 1);
  }
  return gzip(out);
}

PmtilesDirectories with_leaves(std::span<const PmtilesEntry> entries, std::size_t a_leaf) {
  PmtilesDirectories out;
  std::vector<PmtilesEntry> root;
  for (std::size_t first = 0; first < entries.size(); first += a_leaf) {
    const std::string leaf = directory(entries.subspan(first, std::min(a_leaf, entries.size() - first)));
    root.push_back({entries[first].id, out.leaves.size(), static_cast<std::uint32_t>(leaf.size()), 0});
    out.leaves += leaf;
  }
  out.root = directory(root);
  return out;
}

}  // namespace

void append(std::vector<PmtilesEntry>& entries, const PmtilesEntry& tile) {
  if (!entries.empty()) {
    PmtilesEntry& last = entries.back();
    if (last.offset == tile.offset && last.length == tile.length && last.id + last.run == tile.id) {
      last.run += tile.run;
      return;
    }
  }
  entries.push_back(tile);
}

PmtilesDirectories pmtiles_directories(std::span<const PmtilesEntry> entries) {
  // Below this many entries a directory of one level is tried; more never fit.
  constexpr std::size_t kMaybeOne = 16384, kLeaf = 4096;
  if (entries.size() < kMaybeOne) {
    PmtilesDirectories one{directory(entries), ""};
    if (one.root.size() <= kMostRootBytes) return one;
  }
  for (std::size_t a_leaf = kLeaf;; a_leaf *= 2) {
    auto two = with_leaves(entries, a_leaf);
    if (two.root.size() <= kMostRootBytes) return two;
  }
}

}  // namespace cordillera::pipeline::exports
