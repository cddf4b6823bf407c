#pragma once
// Archives read back by code that shares nothing with the writers, from their specifications.
#include <sqlite3.h>
#include <zlib.h>

#include <cstring>
#include <optional>
#include <stdexcept>
#include <string>
#include <vector>

namespace cordillera::pipeline::testing {

template <class T>
T number_at(const std::string& bytes, std::size_t at) {
  T value;
  if (at + sizeof value > bytes.size()) throw std::out_of_range("the file is cut short");
  std::memcpy(&value, bytes.data() + at, sizeof value);
  return value;
}

inline std::string gunzipped(const std::string& bytes) {
  z_stream stream{};
  inflateInit2(&stream, 15 + 16);
  stream.next_in = reinterpret_cast<Bytef*>(const_cast<char*>(bytes.data()));
  stream.avail_in = static_cast<uInt>(bytes.size());
  std::string out, piece(65536, '\0');
  int end = Z_OK;
  while (end == Z_OK) {
    stream.next_out = reinterpret_cast<Bytef*>(piece.data());
    stream.avail_out = static_cast<uInt>(piece.size());
    end = inflate(&stream, Z_NO_FLUSH);
    out.append(piece, 0, piece.size() - stream.avail_out);
  }
  inflateEnd(&stream);
  if (end != Z_STREAM_END) throw std::runtime_error("no gzip stream");
  return out;
}

/// Runs of a directory, leaves followed: by their first id.
struct DirectoryRun {
  std::uint64_t id = 0, count = 0, offset = 0, length = 0;
};

class PmtilesReader {
 public:
  explicit PmtilesReader(std::string bytes) : bytes_(std::move(bytes)) {
    if (bytes_.substr(0, 8) != std::string("PMTiles\3")) throw std::runtime_error("no PMTiles");
    read_directory(bytes_.substr(at64(8), at64(16)));
  }
  std::uint64_t at64(std::size_t at) const { return number_at<std::uint64_t>(bytes_, at); }
  int byte(std::size_t at) const { return static_cast<unsigned char>(bytes_.at(at)); }
  double degrees(std::size_t at) const { return number_at<std::int32_t>(bytes_, at) / 1e7; }
  std::string metadata() const { return gunzipped(bytes_.substr(at64(24), at64(32))); }
  const std::vector<DirectoryRun>& runs() const { return runs_; }
  int leaves() const { return leaves_; }
  std::string tile(const DirectoryRun& run) const { return bytes_.substr(at64(56) + run.offset, run.length); }
  std::optional<std::string> tile(std::uint64_t id) const {
    for (const DirectoryRun& run : runs_) {
      if (id >= run.id && id < run.id + run.count) return tile(run);
    }
    return std::nullopt;
  }

 private:
  void read_directory(const std::string& compressed) {
    const std::string text = gunzipped(compressed);
    std::size_t place = 0;
    const auto varint = [&] {
      std::uint64_t value = 0;
      for (int shift = 0;; shift += 7) {
        const auto part = static_cast<unsigned char>(text.at(place++));
        value |= std::uint64_t{part & 127u} << shift;
        if (part < 128) return value;
      }
    };
    std::vector<DirectoryRun> runs(varint());
    std::uint64_t last = 0;
    for (DirectoryRun& run : runs) last = run.id = last + varint();
    for (DirectoryRun& run : runs) run.count = varint();
    for (DirectoryRun& run : runs) run.length = varint();
    for (std::size_t i = 0; i < runs.size(); ++i) {
      const std::uint64_t offset = varint();
      runs[i].offset = offset == 0 ? runs[i - 1].offset + runs[i - 1].length : offset - 1;
    }
    for (const DirectoryRun& run : runs) {
      if (run.count > 0) {
        runs_.push_back(run);
      } else {
        ++leaves_;
        read_directory(bytes_.substr(at64(40) + run.offset, run.length));
      }
    }
  }

  std::string bytes_;
  std::vector<DirectoryRun> runs_;
  int leaves_ = 0;
};

struct ZipEntry {
  std::string name, bytes;
  std::uint64_t local = 0;
};

/// By the central directory, in its order; sizes, names and checksums of both headers must agree.
inline std::vector<ZipEntry> zip_entries(const std::string& zip) {
  const std::size_t end = zip.size() - 22;
  if (number_at<std::uint32_t>(zip, end) != 0x06054b50) throw std::runtime_error("no end of a ZIP");
  std::vector<ZipEntry> entries;
  std::size_t at = number_at<std::uint32_t>(zip, end + 16);
  for (int count = number_at<std::uint16_t>(zip, end + 10); count > 0; --count) {
    if (number_at<std::uint32_t>(zip, at) != 0x02014b50) throw std::runtime_error("no directory entry");
    const auto crc = number_at<std::uint32_t>(zip, at + 16), size = number_at<std::uint32_t>(zip, at + 24);
    const auto name = number_at<std::uint16_t>(zip, at + 28);
    ZipEntry entry{zip.substr(at + 46, name), "", number_at<std::uint32_t>(zip, at + 42)};
    const std::size_t local = entry.local;
    if (number_at<std::uint32_t>(zip, local) != 0x04034b50 || number_at<std::uint16_t>(zip, local + 8) != 0)
      throw std::runtime_error("not stored");
    if (zip.substr(local + 30, name) != entry.name || number_at<std::uint32_t>(zip, local + 18) != size)
      throw std::runtime_error("headers differ");
    entry.bytes = zip.substr(local + 30 + name, size);
    if (::crc32(0, reinterpret_cast<const Bytef*>(entry.bytes.data()), size) != crc) throw std::runtime_error("wrong checksum");
    at += 46 + name + number_at<std::uint16_t>(zip, at + 30);
    entries.push_back(std::move(entry));
  }
  return entries;
}

/// Every row of a question, columns as text or bytes.
inline std::vector<std::vector<std::string>> sqlite_rows(const std::string& path, const std::string& question) {
  sqlite3* database = nullptr;
  sqlite3_stmt* statement = nullptr;
  std::vector<std::vector<std::string>> rows;
  if (sqlite3_open_v2(path.c_str(), &database, SQLITE_OPEN_READONLY, nullptr) == SQLITE_OK &&
      sqlite3_prepare_v2(database, question.c_str(), -1, &statement, nullptr) == SQLITE_OK) {
    while (sqlite3_step(statement) == SQLITE_ROW) {
      auto& row = rows.emplace_back();
      for (int c = 0; c < sqlite3_column_count(statement); ++c) {
        const void* bytes = sqlite3_column_blob(statement, c);
        row.emplace_back(static_cast<const char*>(bytes), static_cast<std::size_t>(sqlite3_column_bytes(statement, c)));
      }
    }
  }
  sqlite3_finalize(statement);
  sqlite3_close(database);
  return rows;
}

}  // namespace cordillera::pipeline::testing
