#include "raster/open/netcdf_length.h"

#include <algorithm>
#include <array>
#include <fstream>
#include <vector>

namespace cordillera::raster {
namespace {

constexpr std::uint64_t kMostItems = 1 << 16;  // of a list: dimensions, attributes, variables
constexpr std::uint64_t kStreamed = 0xffffffff;

/// The header of CDF-1, CDF-2 (long offsets) and CDF-5 (long numbers too): big-endian, names and values padded to four bytes.
class Header {
 public:
  explicit Header(const std::string& path) : file_(path, std::ios::binary) {
    char magic[4] = "";
    good_ = file_.read(magic, 4) && magic[0] == 'C' && magic[1] == 'D' && magic[2] == 'F' &&
            (magic[3] == 1 || magic[3] == 2 || magic[3] == 5);
    number_bytes_ = magic[3] == 5 ? 8 : 4;
    offset_bytes_ = magic[3] == 1 ? 4 : 8;
  }
  bool good() const { return good_; }
  std::uint64_t number() { return read(number_bytes_); }
  std::uint64_t offset() { return read(offset_bytes_); }
  std::uint64_t type_bytes() {
    constexpr std::array<std::uint64_t, 12> kBytes{0, 1, 1, 2, 4, 4, 8, 1, 2, 4, 8, 8};
    const std::uint64_t type = read(4);
    if (type == 0 || type >= kBytes.size()) good_ = false;
    return good_ ? kBytes[type] : 0;
  }
  void skip(std::uint64_t bytes) {
    if (bytes > std::uint64_t{1} << 40) good_ = false;
    if (good_) file_.seekg(static_cast<std::streamoff>((bytes + 3) / 4 * 4), std::ios::cur);
  }
  void name() { skip(number()); }
  /// A list's tag is not looked at: there is one order of lists.
  std::uint64_t items() {
    read(4);
    const std::uint64_t count = number();
    if (count > kMostItems) good_ = false;
    return good_ ? count : 0;
  }
  void attributes() {
    for (std::uint64_t k = items(); k > 0 && good_; --k) {
      name();
      const std::uint64_t bytes = type_bytes();
      skip(std::min(number(), std::uint64_t{1} << 40) * bytes);
    }
  }

 private:
  std::uint64_t read(int bytes) {
    unsigned char raw[8] = {};
    if (good_ && !file_.read(reinterpret_cast<char*>(raw), bytes)) good_ = false;
    std::uint64_t value = 0;
    for (int k = 0; k < bytes; ++k) value = value << 8 | raw[k];
    return good_ ? value : 0;
  }

  std::ifstream file_;
  bool good_ = false;
  int number_bytes_ = 4, offset_bytes_ = 4;
};

struct Variable {
  std::uint64_t begin = 0, bytes = 0;
  bool records = false;  ///< bytes are of one record
};

/// Products of sizes that no file has stay finite.
std::uint64_t times(std::uint64_t a, std::uint64_t b) {
  constexpr std::uint64_t kMost = std::uint64_t{1} << 60;
  return b != 0 && a > kMost / b ? kMost : a * b;
}

Variable variable(Header& header, const std::vector<std::uint64_t>& lengths) {
  Variable v;
  v.bytes = 1;
  header.name();
  const std::uint64_t dimensions = std::min(header.number(), kMostItems);
  for (std::uint64_t k = 0; k < dimensions && header.good(); ++k) {
    const std::uint64_t id = header.number();
    const std::uint64_t length = id < lengths.size() ? lengths[id] : 1;
    if (k == 0 && length == 0)
      v.records = true;
    else
      v.bytes = times(v.bytes, length);
  }
  header.attributes();
  v.bytes = times(v.bytes, header.type_bytes());
  header.number();  // the size that it states: of large variables it is wrong
  v.begin = header.offset();
  return v;
}

}  // namespace

std::optional<std::uint64_t> netcdf_length(const std::string& path) {
  Header header(path);
  const std::uint64_t records = header.number();
  std::vector<std::uint64_t> lengths;
  for (std::uint64_t k = header.items(); k > 0 && header.good(); --k) {
    header.name();
    lengths.push_back(header.number());
  }
  header.attributes();
  std::vector<Variable> variables;
  for (std::uint64_t k = header.items(); k > 0 && header.good(); --k) variables.push_back(variable(header, lengths));
  if (!header.good()) return std::nullopt;
  std::uint64_t record_bytes = 0, end = 0;
  const auto recorded = std::count_if(variables.begin(), variables.end(), [](const Variable& v) { return v.records; });
  for (const Variable& v : variables)
    if (v.records) record_bytes += recorded == 1 ? v.bytes : (v.bytes + 3) / 4 * 4;
  for (const Variable& v : variables) {
    if (v.records && (records == 0 || records == kStreamed)) continue;
    end = std::max(end, v.begin + v.bytes + (v.records ? times(records - 1, record_bytes) : 0));
  }
  return end;
}

}  // namespace cordillera::raster
