#include "pipeline/encode/strange_json.h"
#include "pipeline/exports/archive_reader.h"
#include "pipeline/exports/gzip.h"
#include "pipeline/exports/whole_file.h"
#include "pipeline/store/sqlite.h"

namespace cordillera::pipeline::exports {
namespace {

constexpr std::size_t kMostTile = std::size_t{64} << 20;
constexpr std::size_t kMostNames = 1000;  // of metadata; others' have about ten

class MbtilesFile final : public ArchiveReader {
 public:
  MbtilesFile(const std::string& path, const std::atomic<bool>* stop)
      : path_(path), database_(path, Database::Mode::foreign, stop) {
    Statement row(database_, "SELECT name, value FROM metadata");
    for (std::size_t bytes = 0; row.step(); metadata_[std::string(row.blob(0))] = std::string(row.blob(1))) {
      bytes += row.blob(0).size() + row.blob(1).size();
      if (metadata_.size() == kMostNames || bytes > kMostTile)
        throw Refused{unreadable(path_, "its metadata has more than 1,000 names, or 64 MiB")};
    }
    // Layers of vector tiles stand in a document of their own.
    const Json more = json_of_stranger(metadata_.value("json", std::string()));
    if (more.is_object() && more.contains("vector_layers")) metadata_["vector_layers"] = more["vector_layers"];
  }
  const Json& metadata() const override { return metadata_; }

  std::optional<ArchiveSize> size() override { return std::nullopt; }

  std::map<int, std::uint64_t> tiles_by_zoom() override {
    std::map<int, std::uint64_t> tiles;
    Statement row(database_, "SELECT zoom_level, count(*) FROM tiles GROUP BY zoom_level");
    while (row.step()) {
      if (row.integer(0) < 0 || row.integer(0) > kMostArchiveZoom) damaged();
      tiles[static_cast<int>(row.integer(0))] = static_cast<std::uint64_t>(row.integer(1));
    }
    return tiles;
  }

  void each_tile(const Take& take) override {
    Statement row(database_, "SELECT zoom_level, tile_column, tile_row, tile_data FROM tiles");
    while (row.step()) {
      const std::int64_t zoom = row.integer(0), x = row.integer(1), up = row.integer(2);
      if (zoom < 0 || zoom > kMostArchiveZoom || std::min(x, up) < 0 || std::max(x, up) >> zoom != 0) damaged();
      const std::string_view bytes = row.blob(3);
      const SquareAddress at{static_cast<int>(zoom), static_cast<std::uint32_t>(x),
                             static_cast<std::uint32_t>((std::int64_t{1} << zoom) - 1 - up)};
      if (!bytes.starts_with("\x1f\x8b")) {
        take({at, bytes});
        continue;
      }
      const auto plain = gunzip(bytes, kMostTile);
      if (!plain) damaged();
      take({at, *plain});
    }
  }

 private:
  [[noreturn]] void damaged() const { throw Refused{unreadable(path_, "it is damaged")}; }

  std::string path_;
  Database database_;
  Json metadata_ = Json::object();
};

}  // namespace

std::unique_ptr<ArchiveReader> open_mbtiles(const std::string& path, const std::atomic<bool>* stop) {
  return std::make_unique<MbtilesFile>(path, stop);
}

}  // namespace cordillera::pipeline::exports
