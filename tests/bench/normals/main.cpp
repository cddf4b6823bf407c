// normals_bench STORE: how near the light on coarse tiles comes to that on the finest surface, and at how many bytes.
//   --tiles N      at most so many tiles of a level, spread evenly; 4
//   --formats      bytes and errors of a normal map in other image formats, too
//   --truth STORE  the same terrain, built with a smaller error: what is true is its finest level
// Every surface is drawn from above, a pixel a cell of the tile's level, of 16 samples each, lit from the north-west at 45
// degrees. The truth is the finest level's triangles with their own normals.
#include <webp/decode.h>
#include <webp/encode.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <functional>
#include <limits>
#include <memory>
#include <string>
#include <vector>

#include "pipeline/encode/decode.h"
#include "pipeline/encode/glb.h"
#include "pipeline/encode/region.h"
#include "pipeline/faces/pictures/png_image.h"
#include "pipeline/faces/pictures/webp_image.h"
#include "pipeline/faces/terrain.h"
#include "pipeline/faces/tiles_3d/normal_map.h"

using namespace cordillera;
using namespace cordillera::pipeline;
using proto::TileAddress;
using proto::Vec3;

namespace {

constexpr int kCells = proto::kTileCells, kSamples = 4, kAcross = kCells * kSamples;
constexpr double kNothing = std::numeric_limits<double>::quiet_NaN();
using Picture = std::vector<double>;  // a number a pixel, 0 to 255, by row from the north

template <class Value>
Value must(proto::Result<Value> result) {
  if (result.ok()) return std::move(result).value();
  std::fprintf(stderr, "%s\n", result.problem().line().c_str());
  std::exit(1);
}

double lit(const Vec3& n) {  // in east, north and up
  static const Vec3 kLight{-0.5, 0.5, std::sqrt(0.5)};
  const double length = std::sqrt(dot(n, n));
  return length > 0 ? 255 * std::max(dot(n, kLight) / length, 0.0) : kNothing;
}

struct Frame {
  Vec3 east, north, up;
  explicit Frame(const Geodetic& at) {
    const double sl = std::sin(at.longitude), cl = std::cos(at.longitude), sp = std::sin(at.latitude), cp = std::cos(at.latitude);
    up = {cp * cl, cp * sl, sp};
    east = {-sl, cl, 0};
    north = {-sp * cl, -sp * sl, cp};
  }
  Vec3 local(const Vec3& v) const { return {dot(v, east), dot(v, north), dot(v, up)}; }
};

/// Samples of a tile, and triangles drawn into them.
class Canvas {
 public:
  explicit Canvas(const TileAddress& tile) : tile_(tile), samples_(std::size_t{kAcross} * kAcross, kNothing) {}

  enum class Shade { by_vertex, by_face };
  void draw(const DecodedGlb& glb, Shade shade) {
    std::vector<std::array<double, 2>> at;
    std::vector<Vec3> local;
    std::vector<Frame> frames;
    const double tiles = std::ldexp(1, tile_.z) / M_PI;
    for (std::size_t v = 0; v < glb.points.size(); ++v) {
      const Geodetic g = geodetic(glb.points[v]);
      at.push_back(
          {((g.longitude + M_PI) * tiles - tile_.x) * kAcross, (tile_.y + 1 - (g.latitude + M_PI / 2) * tiles) * kAcross});
      frames.emplace_back(g);
      local.push_back(frames.back().local(glb.normals[v]));
    }
    for (const Triangle& t : glb.triangles) {
      std::array<Vec3, 3> normals = {local[t[0]], local[t[1]], local[t[2]]};
      if (shade == Shade::by_face)
        normals.fill(frames[t[0]].local(cross(glb.points[t[1]] - glb.points[t[0]], glb.points[t[2]] - glb.points[t[0]])));
      fill({at[t[0]], at[t[1]], at[t[2]]}, normals);
    }
  }

  /// As a client samples a texture.
  void draw(const std::vector<std::uint8_t>& map) {
    const auto pixel = [&](int row, int column) {
      const std::uint8_t* p = &map[3 * (std::size_t(row) * kNormalMapSide + std::size_t(column))];
      return Vec3{p[0] / 127.5 - 1, p[1] / 127.5 - 1, p[2] / 127.5 - 1};
    };
    for (int r = 0; r < kAcross; ++r) {
      for (int c = 0; c < kAcross; ++c) {
        const double x = (c + 0.5) / kSamples, y = (r + 0.5) / kSamples, fx = x - std::floor(x), fy = y - std::floor(y);
        const int i = int(x), j = int(y);
        const Vec3 n = (1 - fy) * ((1 - fx) * pixel(j, i) + fx * pixel(j, i + 1)) +
                       fy * ((1 - fx) * pixel(j + 1, i) + fx * pixel(j + 1, i + 1));
        samples_[std::size_t(r) * kAcross + std::size_t(c)] = lit(n);
      }
    }
  }

  Picture picture() const {
    Picture out(std::size_t{kCells} * kCells);
    for (int r = 0; r < kAcross; ++r) {
      for (int c = 0; c < kAcross; ++c) {
        out[std::size_t(r / kSamples) * kCells + std::size_t(c / kSamples)] +=
            samples_[std::size_t(r) * kAcross + std::size_t(c)] / (kSamples * kSamples);
      }
    }
    return out;
  }

 private:
  void fill(const std::array<std::array<double, 2>, 3>& p, const std::array<Vec3, 3>& n) {
    const auto [x0, x1] = std::minmax({p[0][0], p[1][0], p[2][0]});
    const auto [y0, y1] = std::minmax({p[0][1], p[1][1], p[2][1]});
    const double area = (p[1][0] - p[0][0]) * (p[2][1] - p[0][1]) - (p[1][1] - p[0][1]) * (p[2][0] - p[0][0]);
    if (area == 0) return;
    for (int r = std::max(0, int(std::ceil(y0 - 0.5))); r < kAcross && r + 0.5 <= y1; ++r) {
      for (int c = std::max(0, int(std::ceil(x0 - 0.5))); c < kAcross && c + 0.5 <= x1; ++c) {
        const auto share = [&](int a, int b) {
          return ((p[a][0] - c - 0.5) * (p[b][1] - r - 0.5) - (p[a][1] - r - 0.5) * (p[b][0] - c - 0.5)) / area;
        };
        const double a = share(1, 2), b = share(2, 0), d = share(0, 1);
        if (a < -1e-9 || b < -1e-9 || d < -1e-9) continue;
        samples_[std::size_t(r) * kAcross + std::size_t(c)] = lit(a * n[0] + b * n[1] + d * n[2]);
      }
    }
  }

  TileAddress tile_;
  std::vector<double> samples_;
};

struct Difference {
  double squares = 0, similar = 0;
  std::size_t pixels = 0, windows = 0;
  double rms() const { return std::sqrt(squares / double(std::max<std::size_t>(pixels, 1))); }
  double ssim() const { return similar / double(std::max<std::size_t>(windows, 1)); }
};

/// Structural similarity after Wang et al. 2004, in windows of 8 x 8 every 4 pixels; windows with nothing in them are left out.
void compare(const Picture& a, const Picture& b, Difference& to) {
  constexpr int kWindow = 8, kStride = 4;
  constexpr double kC1 = 6.5025, kC2 = 58.5225;
  for (std::size_t k = 0; k < a.size(); ++k) {
    if (std::isnan(a[k]) || std::isnan(b[k])) continue;
    to.squares += (a[k] - b[k]) * (a[k] - b[k]);
    ++to.pixels;
  }
  for (int r = 0; r + kWindow <= kCells; r += kStride) {
    for (int c = 0; c + kWindow <= kCells; c += kStride) {
      double sa = 0, sb = 0, saa = 0, sbb = 0, sab = 0;
      for (int y = r; y < r + kWindow; ++y) {
        for (int x = c; x < c + kWindow; ++x) {
          const double p = a[std::size_t(y) * kCells + std::size_t(x)], q = b[std::size_t(y) * kCells + std::size_t(x)];
          sa += p, sb += q, saa += p * p, sbb += q * q, sab += p * q;
        }
      }
      constexpr double n = kWindow * kWindow;
      const double ma = sa / n, mb = sb / n, va = saa / n - ma * ma, vb = sbb / n - mb * mb, cov = sab / n - ma * mb;
      const double s = (2 * ma * mb + kC1) * (2 * cov + kC2) / ((ma * ma + mb * mb + kC1) * (va + vb + kC2));
      if (std::isnan(s)) continue;
      to.similar += s;
      ++to.windows;
    }
  }
}

class Bench {
 public:
  Bench(const faces::Terrain& terrain, const StoreReader& truth, std::size_t tiles, bool formats)
      : terrain_(terrain), true_(truth), tiles_(tiles), formats_(formats) {}

  void run() {
    std::printf("| level | tiles | what | bytes a tile | rms of 255 | SSIM |\n|--:|--:|---|--:|--:|--:|\n");
    for (int z = &true_ == &terrain_.store() ? finest() - 1 : finest(); z >= int(terrain_.manifest().min_level()); --z) level(z);
  }

 private:
  struct Row {
    std::string what;
    double bytes = 0;
    Difference difference;
  };
  int finest() const { return int(terrain_.manifest().max_level()); }

  void level(int z) {
    const auto records = terrain_.store().records(z, 0, 0, proto::tiles_across(z) - 1, proto::tiles_up(z) - 1);
    if (records.empty()) return;
    rows_.clear();
    const std::size_t count = std::min(tiles_, records.size());
    for (std::size_t k = 0; k < count; ++k) {
      const auto& record = records[(2 * k + 1) * records.size() / (2 * count)];
      tile({z, std::int32_t(record.x()), std::int32_t(record.y())});
    }
    for (const Row& row : rows_) {
      std::printf("| %d | %zu | %s | %.0f | %.2f | %.3f |\n", z, count, row.what.c_str(), row.bytes / double(count),
                  row.difference.rms(), row.difference.ssim());
    }
    std::fflush(stdout);
  }

  void add(const std::string& what, std::size_t bytes, const Picture& picture) {
    auto row = std::find_if(rows_.begin(), rows_.end(), [&](const Row& r) { return r.what == what; });
    if (row == rows_.end()) row = rows_.insert(rows_.end(), Row{what, 0, {}});
    row->bytes += double(bytes);
    compare(picture, truth_, row->difference);
  }

  /// All tiles of a level within one.
  static std::pair<Picture, std::size_t> drawn(const StoreReader& store, const TileAddress& tile, int z, Canvas::Shade shade) {
    Canvas canvas(tile);
    std::size_t bytes = 0;
    const int up = z - tile.z;
    const auto last = [&](std::int32_t v) { return ((v + 1) << up) - 1; };
    for (const auto& record : store.records(z, tile.x << up, tile.y << up, last(tile.x), last(tile.y))) {
      const auto glb = store.tile({z, std::int32_t(record.x()), std::int32_t(record.y())}, Encoding::glb)->bytes;
      bytes += glb.size();
      canvas.draw(must(decode_glb(glb)), shade);
    }
    return {canvas.picture(), bytes};
  }

  void tile(const TileAddress& tile) {
    truth_ = drawn(true_, tile, int(true_.manifest().max_level()), Canvas::Shade::by_face).first;
    for (int finer = 0; finer <= 2 && tile.z + finer <= finest(); ++finer) {
      const auto [picture, bytes] = drawn(terrain_.store(), tile, tile.z + finer, Canvas::Shade::by_vertex);
      add("vertex normals" + (finer == 0 ? std::string() : ", level + " + std::to_string(finer)), bytes, picture);
    }
    const std::size_t bare = terrain_.store().glb(tile, {Normals::texture, {}})->bytes.size();
    for (int finer = 0; finer <= 4 && tile.z + finer <= finest(); ++finer) {
      const auto map = faces::normal_map(terrain_, tile, finer);
      add("normal map of level + " + std::to_string(finer), bare + faces::webp(map, kNormalMapSide).size(), shaded(tile, map));
    }
    if (formats_) other_formats(tile, bare);
  }

  static Picture shaded(const TileAddress& tile, const std::vector<std::uint8_t>& map) {
    Canvas canvas(tile);
    canvas.draw(map);
    return canvas.picture();
  }

  void other_formats(const TileAddress& tile, std::size_t bare) {
    const auto map = faces::normal_map(terrain_, tile);
    add("... as PNG", bare + faces::png(map, kNormalMapSide, faces::Pixel::rgb).size(), shaded(tile, map));
    for (const int effort : {4, 6, 9})
      webp(tile, map, bare, "... lossless, effort " + std::to_string(effort),
           [&](WebPConfig& c) { WebPConfigLosslessPreset(&c, effort); });
    for (const int quality : {80, 60, 40}) {
      webp(tile, map, bare, "... near-lossless " + std::to_string(quality), [&](WebPConfig& c) {
        WebPConfigLosslessPreset(&c, 2);
        c.near_lossless = quality;
      });
    }
    for (const float quality : {98.F, 95.F, 90.F, 80.F}) {
      webp(tile, map, bare, "... lossy " + std::to_string(int(quality)), [&](WebPConfig& c) {
        c.quality = quality;
        c.use_sharp_yuv = 1;
      });
    }
  }

  void webp(const TileAddress& tile, const std::vector<std::uint8_t>& map, std::size_t bare, const std::string& what,
            const std::function<void(WebPConfig&)>& set) {
    WebPConfig config;
    WebPConfigInit(&config);
    set(config);
    WebPPicture picture;
    WebPMemoryWriter writer;
    WebPPictureInit(&picture);
    WebPMemoryWriterInit(&writer);
    picture.use_argb = 1;
    picture.width = picture.height = int(kNormalMapSide);
    picture.writer = WebPMemoryWrite;
    picture.custom_ptr = &writer;
    WebPPictureImportRGB(&picture, map.data(), 3 * picture.width);
    if (WebPEncode(&config, &picture) == 0) std::abort();
    int side = 0;
    std::unique_ptr<std::uint8_t, void (*)(void*)> rgb(WebPDecodeRGB(writer.mem, writer.size, &side, &side), WebPFree);
    add(what, bare + writer.size, shaded(tile, {rgb.get(), rgb.get() + map.size()}));
    WebPMemoryWriterClear(&writer);
    WebPPictureFree(&picture);
  }

  const faces::Terrain& terrain_;
  const StoreReader& true_;
  std::size_t tiles_;
  bool formats_;
  std::vector<Row> rows_;
  Picture truth_;
};

}  // namespace

int main(int argc, char** argv) {
  std::size_t tiles = 4;
  bool formats = false;
  std::string path, truth;
  for (int k = 1; k < argc; ++k) {
    const std::string argument = argv[k];
    if (argument == "--tiles" && k + 1 < argc)
      tiles = std::strtoul(argv[++k], nullptr, 10);
    else if (argument == "--formats")
      formats = true;
    else if (argument == "--truth" && k + 1 < argc)
      truth = argv[++k];
    else
      path = argument;
  }
  const faces::Terrain terrain(std::shared_ptr<const StoreReader>(must(StoreReader::open(path))));
  const auto other = truth.empty() ? nullptr : must(StoreReader::open(truth));
  Bench(terrain, other ? *other : terrain.store(), tiles, formats).run();
}
