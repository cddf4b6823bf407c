// EGM96 must always work, and Debian ships no GeographicLib grid. PROJ's package carries the same 15' grid as GTX: rewrite it once.
#include <unistd.h>

#include <bit>
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <mutex>
#include <vector>

#include "raster/geoid.h"

namespace cordillera::raster {
namespace {

namespace fs = std::filesystem;

constexpr double kOffset_m = -108, kScale_m = 0.003;

struct Gtx {
  double south_deg = 0, west_deg = 0, step_lat_deg = 0, step_lon_deg = 0;
  int rows = 0, columns = 0;
  std::vector<float> height_m;  ///< from the south-west, row by row
};

std::uint64_t big_endian(const unsigned char* bytes, int count) {
  std::uint64_t value = 0;
  for (int k = 0; k < count; ++k) value = value << 8 | bytes[k];
  return value;
}

bool read_gtx(const std::string& path, Gtx& gtx) {
  std::ifstream file(path, std::ios::binary);
  unsigned char head[40];
  if (!file.read(reinterpret_cast<char*>(head), sizeof head)) return false;
  double* const fields[] = {&gtx.south_deg, &gtx.west_deg, &gtx.step_lat_deg, &gtx.step_lon_deg};
  for (int k = 0; k < 4; ++k) *fields[k] = std::bit_cast<double>(big_endian(head + 8 * k, 8));
  gtx.rows = static_cast<int>(big_endian(head + 32, 4));
  gtx.columns = static_cast<int>(big_endian(head + 36, 4));
  if (gtx.rows < 2 || gtx.columns < 2 || gtx.rows > 20000 || gtx.columns > 40000) return false;
  std::vector<unsigned char> bytes(std::size_t{4} * gtx.rows * gtx.columns);
  if (!file.read(reinterpret_cast<char*>(bytes.data()), static_cast<std::streamsize>(bytes.size()))) return false;
  gtx.height_m.resize(bytes.size() / 4);
  for (std::size_t k = 0; k < gtx.height_m.size(); ++k)
    gtx.height_m[k] = std::bit_cast<float>(static_cast<std::uint32_t>(big_endian(bytes.data() + 4 * k, 4)));
  return true;
}

/// GeographicLib wants the whole globe: from 90 N down to 90 S, from 0 E eastward.
bool is_global(const Gtx& gtx) {
  return gtx.south_deg == -90 && gtx.columns % 2 == 0 && gtx.rows == gtx.columns / 2 + 1 &&
         std::abs(gtx.step_lon_deg * gtx.columns - 360) < 1e-9 && std::abs(gtx.step_lat_deg - gtx.step_lon_deg) < 1e-12;
}

std::vector<fs::path> cache_folders() {
  const auto env = [](const char* name) -> std::string { const char* v = std::getenv(name); return v == nullptr ? "" : v; };
  std::vector<fs::path> folders;
  if (const auto own = env("CORDILLERA_CACHE"); !own.empty()) folders.emplace_back(own);
  if (const auto xdg = env("XDG_CACHE_HOME"); !xdg.empty()) folders.emplace_back(fs::path(xdg) / "cordillera");
  if (const auto home = env("HOME"); !home.empty()) folders.emplace_back(fs::path(home) / ".cache" / "cordillera");
  std::error_code error;
  folders.emplace_back(fs::temp_directory_path(error) / ("cordillera-" + std::to_string(getuid())));
  return folders;
}

std::string find_gtx() {
  std::vector<fs::path> folders;
  for (const char* name : {"PROJ_DATA", "PROJ_LIB"})
    if (const char* folder = std::getenv(name)) folders.emplace_back(folder);
  folders.insert(folders.end(), {"/usr/share/proj", "/usr/local/share/proj"});
  std::error_code error;
  for (const fs::path& folder : folders)
    if (fs::is_regular_file(folder / "egm96_15.gtx", error)) return (folder / "egm96_15.gtx").string();
  return "";
}

}  // namespace

bool write_pgm_from_gtx(const std::string& gtx_path, const std::string& pgm_path) {
  Gtx gtx;
  if (!read_gtx(gtx_path, gtx) || !is_global(gtx)) return false;
  const int turn = static_cast<int>(std::lround((0 - gtx.west_deg) / gtx.step_lon_deg));  // column of the prime meridian
  std::string out = "P5\n# Geoid file in PGM format for the GeographicLib::Geoid class\n# Description WGS84 EGM96, 15-minute grid\n"
                    "# Source PROJ egm96_15.gtx, rewritten by Cordillera\n# Offset -108\n# Scale 0.003\n# Origin 90N 0E\n"
                    "# AREA_OR_POINT Point\n# Vertical_Datum WGS84\n" +
                    std::to_string(gtx.columns) + " " + std::to_string(gtx.rows) + "\n65535\n";
  for (int r = gtx.rows - 1; r >= 0; --r) {
    for (int c = 0; c < gtx.columns; ++c) {
      const int from = ((c + turn) % gtx.columns + gtx.columns) % gtx.columns;
      const double height = gtx.height_m[static_cast<std::size_t>(r) * gtx.columns + from];
      const auto step = static_cast<std::uint16_t>(std::lround((height - kOffset_m) / kScale_m));
      out += static_cast<char>(step >> 8);
      out += static_cast<char>(step & 255);
    }
  }
  // Several processes may find the grid missing at once: each writes its own file, the last rename wins with the same bytes.
  const std::string draft = pgm_path + "." + std::to_string(getpid());
  std::ofstream file(draft, std::ios::binary | std::ios::trunc);
  file.write(out.data(), static_cast<std::streamsize>(out.size()));
  file.close();
  std::error_code error;
  if (file) fs::rename(draft, pgm_path, error);
  if (file && !error) return true;
  fs::remove(draft, error);
  return false;
}

std::string ensure_egm96_pgm() {
  static std::mutex one_thread;  // of a process: all write to a file of the same name
  const std::lock_guard lock(one_thread);
  std::error_code error;
  const std::string gtx = find_gtx();
  for (const fs::path& folder : cache_folders()) {
    const std::string path = (folder / "egm96-15.pgm").string();
    if (fs::is_regular_file(path, error)) return path;
    fs::create_directories(folder, error);
    if (!gtx.empty() && !error && write_pgm_from_gtx(gtx, path)) return path;
  }
  return "";
}

}  // namespace cordillera::raster
