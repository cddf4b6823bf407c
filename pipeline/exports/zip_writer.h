#pragma once
// A ZIP file whose entries are stored as they are, with ZIP64 where numbers need it. After PKWARE's APPNOTE 6.3.
#include <cstdint>
#include <ostream>
#include <string>
#include <string_view>

namespace cordillera::pipeline::exports {

class ZipWriter {
 public:
  explicit ZipWriter(std::ostream& out) : out_(out) {}

  /// Where the entry's local header begins. bytes: less than 4 GiB. All entries have one date, so that equal content gives equal
  /// files.
  std::uint64_t add(std::string_view name, std::string_view bytes);
  /// Central directory and end.
  void finish();

 private:
  void add_end(std::uint64_t directory);
  void add_end64(std::uint64_t directory);

  std::ostream& out_;
  std::uint64_t offset_ = 0, entries_ = 0;
  std::string directory_;  // grows by some 80 bytes an entry
};

}  // namespace cordillera::pipeline::exports
