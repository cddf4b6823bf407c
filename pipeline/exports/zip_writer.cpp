#include "pipeline/exports/zip_writer.h"

#include <algorithm>
#include <limits>
#include <stdexcept>

#include "pipeline/encode/little_endian.h"
#include "pipeline/exports/gzip.h"
#include "pipeline/exports/whole_file.h"

namespace cordillera::pipeline::exports {
namespace {

constexpr std::uint16_t kVersion = 20, kVersion64 = 45, kUtf8 = 1 << 11, kStored = 0;
constexpr std::uint16_t kMidnight = 0, kFirstDay = 1 << 5 | 1;  // of 1980, when ZIP's time begins
constexpr std::uint32_t kMost32 = std::numeric_limits<std::uint32_t>::max();
constexpr std::uint16_t kMost16 = std::numeric_limits<std::uint16_t>::max();

void append16(std::string& out, std::uint16_t value) { append_little_endian(out, value); }
void append32(std::string& out, std::uint32_t value) { append_little_endian(out, value); }
void append64(std::string& out, std::uint64_t value) { append_little_endian(out, value); }

/// What the local header and the directory say alike, from the version on.
void append_common(std::string& out, std::uint16_t version, std::string_view name, std::string_view bytes) {
  append16(out, version);
  append16(out, kUtf8);
  append16(out, kStored);
  append16(out, kMidnight);
  append16(out, kFirstDay);
  append32(out, crc32(bytes));
  append32(out, static_cast<std::uint32_t>(bytes.size()));
  append32(out, static_cast<std::uint32_t>(bytes.size()));
  append16(out, static_cast<std::uint16_t>(name.size()));
}

}  // namespace

std::uint64_t ZipWriter::add(std::string_view name, std::string_view bytes) {
  if (bytes.size() >= kMost32 || name.size() >= kMost16) throw std::logic_error("an entry of a ZIP file is too large");
  const std::uint64_t at = offset_;
  const bool far = at >= kMost32;
  std::string local;
  append32(local, 0x04034b50);
  append_common(local, kVersion, name, bytes);
  append16(local, 0);  // no extra field
  local += name;
  append(out_, local);
  append(out_, bytes);
  offset_ += local.size() + bytes.size();
  ++entries_;

  append32(directory_, 0x02014b50);
  append16(directory_, far ? kVersion64 : kVersion);
  append_common(directory_, far ? kVersion64 : kVersion, name, bytes);
  append16(directory_, far ? 12 : 0);
  append16(directory_, 0);  // no comment
  append16(directory_, 0);  // first disk
  append16(directory_, 0);  // no text
  append32(directory_, 0);  // no attributes
  append32(directory_, far ? kMost32 : static_cast<std::uint32_t>(at));
  directory_ += name;
  if (far) {
    append16(directory_, 1);  // ZIP64
    append16(directory_, 8);
    append64(directory_, at);
  }
  return at;
}

void ZipWriter::add_end64(std::uint64_t directory) {
  std::string end;
  append32(end, 0x06064b50);
  append64(end, 44);  // bytes that follow in this record
  append16(end, kVersion64);
  append16(end, kVersion64);
  append32(end, 0);
  append32(end, 0);
  append64(end, entries_);
  append64(end, entries_);
  append64(end, directory_.size());
  append64(end, directory);
  append32(end, 0x07064b50);  // where that record is
  append32(end, 0);
  append64(end, directory + directory_.size());
  append32(end, 1);
  append(out_, end);
}

void ZipWriter::add_end(std::uint64_t directory) {
  const auto count = static_cast<std::uint16_t>(std::min<std::uint64_t>(entries_, kMost16));
  std::string end;
  append32(end, 0x06054b50);
  append16(end, 0);
  append16(end, 0);
  append16(end, count);
  append16(end, count);
  append32(end, static_cast<std::uint32_t>(std::min<std::uint64_t>(directory_.size(), kMost32)));
  append32(end, static_cast<std::uint32_t>(std::min<std::uint64_t>(directory, kMost32)));
  append16(end, 0);
  append(out_, end);
}

void ZipWriter::finish() {
  const std::uint64_t directory = offset_;
  append(out_, directory_);
  if (entries_ >= kMost16 || directory_.size() >= kMost32 || directory >= kMost32) add_end64(directory);
  add_end(directory);
}

}  // namespace cordillera::pipeline::exports
