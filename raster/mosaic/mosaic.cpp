#include "raster/mosaic/mosaic.h"

#include <sys/resource.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>
#include <optional>
#include <set>
#include <span>

#include "proto/integers.h"
#include "proto/lru.h"
#include "raster/mosaic/blend.h"
#include "raster/mosaic/grid_neighbours.h"
#include "raster/mosaic/laid.h"
#include "raster/mosaic/mosaic_description.h"
#include "raster/mosaic/sheets.h"
#include "raster/mosaic/window_index.h"
#include "raster/open/text_rows.h"
#include "raster/pixels/decimation.h"
#include "raster/voids/void_height.h"

namespace cordillera::raster {
namespace {

/// A block may lie over that many rasters without opening one twice, which takes milliseconds. Each thread has as many open: a
/// process that may have a thousand files has fewer.
std::size_t open_files() {
  constexpr rlim_t kLeast = 24, kMost = 64, kShare = 64;
  rlimit limit{};
  return getrlimit(RLIMIT_NOFILE, &limit) == 0 ? std::clamp(limit.rlim_cur / kShare, kLeast, kMost) : kLeast;
}

using Window = Source::Window;

/// Data of any raster counts before a height that is put where one has none.
constexpr VoidRule kByWeight[] = {VoidRule::hole, VoidRule::value};

bool puts_height(const MosaicMember& member) {
  const auto height_m = void_height_m(member.options.voids());
  return height_m.ok() && height_m->has_value();
}

bool same(const Window& a, const Window& b) {
  return a.west == b.west && a.south == b.south && a.east == b.east && a.north == b.north;
}

class Mosaic final : public Source {
 public:
  Mosaic(std::vector<MosaicMember> members, double feather_m)
      : members_(std::move(members)),
        feather_m_(feather_m),
        sheets_(feather_m > 0 ? sheets_of(members_) : std::vector<std::size_t>()),
        neighbours_(members_, sheets_) {
    description_ = describe_mosaic(members_, window(kMemberLattice));
  }

  const proto::Source& description() const override { return description_; }

  Window window(const proto::Lattice& lattice) const override {
    if (const auto known = windows_.find(lattice.finest_level); known != windows_.end()) return known->second;
    std::vector<Window> windows;
    for (const MosaicMember& member : members_) {
      const Window w = coarser(member.window, lattice);
      if (w.west <= w.east && w.south <= w.north) windows.push_back(w);
    }
    return windows_[lattice.finest_level] = windows.empty() ? Window{0, 0, -1, -1} : hull(std::move(windows), lattice.columns());
  }

  bool empty(const proto::Lattice& lattice, std::int64_t west, std::int64_t south, std::int64_t columns,
             std::int64_t rows) const override {
    return under({west, south, west + columns - 1, south + rows - 1}, lattice).empty();
  }

  proto::Result<proto::Samples> sample(const proto::Lattice& lattice, std::int64_t west, std::int64_t south, std::int32_t columns,
                                       std::int32_t rows) override {
    const Window asked{west, south, west + columns - 1, south + rows - 1};
    const std::vector<std::size_t> layers = under(with_feather(asked, lattice), lattice);
    if (layers.size() == 1) {  // one raster alone has no seam
      auto source = opened(layers.front(), VoidRule::value);
      if (!source.ok()) return source.problem();
      auto alone = (*source)->sample(lattice, west, south, columns, rows);
      if (!alone.ok() || members_.size() == 1) return alone;
      if (auto done = level_poles(lattice, *alone); !done.ok()) return done.problem();
      return alone;
    }
    auto sum = last_ && last_->level == lattice.finest_level && same(last_->window, asked)
                   ? proto::Result<Laid>(std::move(last_->laid))
                   : laid(lattice, asked, layers);
    last_.reset();
    if (!sum.ok()) return sum.problem();
    if (auto done = level_poles(lattice, sum->samples); !done.ok()) return done.problem();
    return cut_out(sum->samples, asked);
  }

  proto::Result<void> nearest(std::span<const double> longitude_deg, std::span<const double> latitude_deg, double* out) override {
    const std::span<double> all(out, longitude_deg.size());
    const auto ask = [&](Source& source, double* values) { return source.nearest(longitude_deg, latitude_deg, values); };
    if (all.empty()) return {};
    return uppermost(under(around(longitude_deg, latitude_deg), kMemberLattice), ask, all);
  }
  proto::Result<void> nearest_in_cells(const proto::Lattice& lattice, const Window& cells, double* out) override {
    const std::span<double> all(out, static_cast<std::size_t>((cells.east - cells.west) * (cells.north - cells.south)));
    const auto ask = [&](Source& source, double* values) { return source.nearest_in_cells(lattice, cells, values); };
    return all.empty() ? proto::Result<void>() : uppermost(under(middles_of(cells, lattice), kMemberLattice), ask, all);
  }

  void share_pixels(const std::shared_ptr<SharedPixels>& lately, std::size_t /*raster*/) override { lately_ = lately; }

  /// Those that the surface is made of: of the raster that wins at all vertices around, or goes on there as one of the same grid.
  /// Where rasters are blended there are none.
  proto::Result<std::vector<PixelPoint>> pixels(const proto::Lattice& lattice, const Window& cells) override {
    const std::vector<std::size_t> layers = under(cells, lattice);
    if (layers.size() == 1) {
      auto source = opened(layers.front(), VoidRule::value);
      return source.ok() ? (*source)->pixels(lattice, cells) : proto::Result<std::vector<PixelPoint>>(source.problem());
    }
    auto surface = laid(lattice, cells, under(with_feather(cells, lattice), lattice));
    if (!surface.ok()) return surface.problem();
    const proto::Samples& there = surface->samples;
    const std::set<std::size_t> owners(surface->owners.begin(), surface->owners.end());
    std::vector<PixelPoint> out;
    // Several rasters may have a pixel beyond the side of another: it counts once.
    std::set<std::pair<std::int64_t, std::int64_t>> at_seams;
    const auto rounded = [](const PixelPoint& pixel) {
      return std::pair(std::llround(pixel.x * 1024), std::llround(pixel.y * 1024));
    };
    for (const std::size_t layer : layers) {
      if (is_hidden(layer, owners)) continue;
      auto source = opened(layer, VoidRule::value);
      if (!source.ok()) return source.problem();
      std::vector<PixelNumber> numbers;
      const auto own = (*source)->numbered_pixels(lattice, cells, &numbers);
      if (!own.ok()) return own.problem();
      for (std::size_t k = 0; k < own->size(); ++k) {
        const PixelPoint& pixel = (*own)[k];
        const std::int64_t column = cells.west - there.west + static_cast<std::int64_t>(pixel.x),
                           row = cells.south - there.south +
                                 std::min(static_cast<std::int64_t>(pixel.y), cells.north - cells.south - 1);
        const auto owner = [&](std::int64_t v) {
          return surface->owners[static_cast<std::size_t>(row * there.columns + column + v)];
        };
        const std::int64_t up = there.columns;
        const std::array<std::size_t, 4> around{owner(0), owner(1), owner(up), owner(up + 1)};
        if (std::ranges::all_of(around, [&](std::size_t one) { return one == layer; })) {
          out.push_back(pixel);
          continue;
        }
        const auto shapes = shapes_surface(layer, around, numbers[k]);
        if (!shapes.ok()) return shapes.problem();
        if (*shapes && at_seams.insert(rounded(pixel)).second) out.push_back(pixel);
      }
    }
    last_ = LastLaid{lattice.finest_level, cells, std::move(*surface)};
    return out;
  }

 private:
  /// Of each place what the first of the layers says that has something there: data, else a height in its place. ask: one layer,
  /// of all places. None that is wholly hidden is asked.
  template <class Ask>
  proto::Result<void> uppermost(const std::vector<std::size_t>& layers, const Ask& ask, std::span<double> out) {
    std::ranges::fill(out, std::numeric_limits<double>::quiet_NaN());
    std::vector<double> values(out.size());
    for (const VoidRule voids : kByWeight) {
      for (const std::size_t layer : layers) {
        if (std::ranges::none_of(out, [](double value) { return std::isnan(value); })) return {};
        if (voids == VoidRule::value && !puts_height(members_[layer])) continue;
        auto source = opened(layer, voids);
        if (!source.ok()) return source.problem();
        if (auto done = ask(**source, values.data()); !done.ok()) return done.problem();
        std::ranges::transform(out, values, out.begin(),
                               [](double above, double here) { return std::isnan(above) ? here : above; });
      }
    }
    return {};
  }

  /// The vertices at which a member may have data.
  Window reach_of(std::size_t member, const proto::Lattice& lattice) const {
    const MosaicMember& m = members_[member];
    return widened(coarser(m.window, lattice), members_.size() > 1 ? reach_of_points(m.description, lattice) : 0);
  }

  /// Members that may have data in the window, the one that wins first.
  std::vector<std::size_t> under(const Window& window, const proto::Lattice& lattice) const {
    std::vector<std::size_t> found;
    for (std::size_t k = 0; k < members_.size(); ++k) {
      if (touch(reach_of(k, lattice), window, lattice)) found.push_back(k);
    }
    return found;
  }

  /// With as much around a window as tells how far its vertices are from the rims that are blended.
  Window with_feather(const Window& w, const proto::Lattice& lattice) const {
    const int feather = members_.size() > 1 ? feather_vertices(feather_m_, lattice) : 0;
    return {w.west - feather, std::max<std::int64_t>(0, w.south - feather), w.east + feather,
            std::min(lattice.rows(), w.north + feather)};
  }
  std::size_t sheet_of(std::size_t member) const { return sheets_.empty() ? 0 : sheets_[member]; }

  /// Of members that are of one map: the data of the first that has some. None that is wholly hidden is read.
  proto::Result<Laid> one_map(const proto::Lattice& lattice, const Window& w, std::span<const std::size_t> layers) {
    Laid map(w);
    for (const std::size_t layer : layers) {
      if (!may_add(reach_of(layer, lattice), map, lattice)) continue;
      auto source = opened(layer, VoidRule::hole);
      if (!source.ok()) return source.problem();
      const auto own = (*source)->sample(lattice, w.west, w.south, map.samples.columns, map.samples.rows);
      if (!own.ok()) return own.problem();
      for (std::size_t v = 0; v < map.owners.size(); ++v) {
        if (map.owners[v] != kNobody || own->height[v] == proto::kNoHeight) continue;
        map.samples.height[v] = own->height[v], map.samples.flat_water[v] = own->flat_water[v];
        map.owners[v] = layer;
      }
    }
    return map;
  }

  /// The data of all layers, and heights where none has any. The samples reach beyond the window where some are blended.
  proto::Result<Laid> laid(const proto::Lattice& lattice, const Window& w, std::span<const std::size_t> layers) {
    auto sum = data_of(lattice, w, layers);
    if (!sum.ok() || std::ranges::none_of(layers, [this](std::size_t layer) { return puts_height(members_[layer]); })) return sum;
    std::vector<Layer> all;
    for (const std::size_t layer : layers) all.push_back({layer, reach_of(layer, lattice), puts_height(members_[layer])});
    const auto with_heights = [&, &s = sum->samples](std::size_t layer) -> proto::Result<proto::Samples> {
      auto source = opened(layer, VoidRule::value);
      return source.ok() ? (*source)->sample(lattice, s.west, s.south, s.columns, s.rows) : source.problem();
    };
    const auto done = put_heights(lattice, all, with_heights, *sum);
    return done.ok() ? std::move(sum) : done.problem();
  }

  /// The data of all layers, the first of which wins.
  proto::Result<Laid> data_of(const proto::Lattice& lattice, const Window& w, std::span<const std::size_t> layers) {
    if (layers.empty() || sheet_of(layers.front()) == sheet_of(layers.back())) return one_map(lattice, w, layers);
    const Window wide = with_feather(w, lattice);
    Laid sum(wide);
    while (!layers.empty()) {  // from the lowest up, a map at a time
      const std::size_t sheet = sheet_of(layers.back());
      const auto first = std::find_if(layers.begin(), layers.end(), [&](std::size_t layer) { return sheet_of(layer) == sheet; });
      const auto map = one_map(lattice, wide, {first, layers.end()});
      if (!map.ok()) return map.problem();
      const auto mixed = lay_over(map->samples, sum.samples, feather_vertices(feather_m_, lattice));
      for (std::size_t v = 0; v < mixed.size(); ++v)
        if (map->owners[v] != kNobody) sum.owners[v] = mixed[v] != 0 ? kSeveral : map->owners[v];
      layers = {layers.begin(), first};
    }
    return sum;
  }

  using Opened = std::shared_ptr<RasterSource>;  ///< held by who works with it: others are opened meanwhile
  /// voids: what those of the raster are until it is asked for again.
  proto::Result<Opened> opened(std::size_t member, VoidRule voids) {
    if (auto open = open_.find(member)) {
      (*open)->set_voids(voids);
      return *open;
    }
    const MosaicMember& m = members_[member];
    auto source = m.decimation ? open_decimated(m.path, m.name, m.trust, m.options, m.decimation)
                               : open_source(m.path, m.name, m.trust, m.options);
    if (!source.ok()) return source.problem();
    const Opened kept(&dynamic_cast<RasterSource&>(*source->release()));  // what these give
    kept->set_voids(voids);
    if (members_.size() > 1)
      kept->set_beyond([this, member, own = kept.get()](const PixelWindow& window, std::vector<double>& heights) {
        return read_beyond(member, *own, window, heights);
      });
    if (lately_) kept->share_pixels(lately_, member);
    open_.keep(member, kept, m.description.driver() == kTextGrid ? 2 : 1);  // it has a copy, too
    return kept;
  }

  /// Whether a member's pixel has a part in all heights around it: they are its own, or of others that read across their side, or
  /// have the same height there. Of those that have, it is the first one's pixel alone.
  proto::Result<bool> shapes_surface(std::size_t member, const std::array<std::size_t, 4>& owners, const PixelNumber& pixel) {
    if (puts_height(members_[member])) {  // beside others only data count
      const auto own_m = pixel_m(member, pixel);
      if (!own_m.ok()) return own_m.problem();
      if (std::isnan(*own_m)) return false;
    }
    for (auto owner = owners.begin(); owner != owners.end(); ++owner) {
      if (*owner == kNobody || *owner == member || std::find(owners.begin(), owner, *owner) != owner) continue;
      if (*owner == kSeveral) return false;
      if (neighbours_.reads_across(*owner, member, pixel)) continue;
      if (*owner < member || std::ranges::find(owners, member) == owners.end()) return false;
      const auto same = is_same_pixel(member, pixel, *owner);
      if (!same.ok() || !*same) return same;
    }
    return true;
  }

  /// Whether another member has a member's pixel, too, with the same height, as those have that were cut with a shared row.
  proto::Result<bool> is_same_pixel(std::size_t member, const PixelNumber& pixel, std::size_t other) {
    const auto there = neighbours_.number_in(other, member, pixel);
    if (!there) return false;
    const auto here_m = pixel_m(member, pixel), there_m = pixel_m(other, *there);
    if (!here_m.ok()) return here_m.problem();
    if (!there_m.ok()) return there_m.problem();
    return *here_m == *there_m;
  }
  proto::Result<double> pixel_m(std::size_t member, const PixelNumber& pixel) {
    const auto source = opened(member, VoidRule::hole);
    if (!source.ok()) return source.problem();
    std::vector<double> height_m;
    if (auto done = (*source)->own_pixels({pixel.column, pixel.row, 1, 1}, height_m); !done.ok()) return done.problem();
    return height_m.front();
  }

  /// Whether no pixel of a layer shapes the surface between vertices of these owners.
  bool is_hidden(std::size_t layer, const std::set<std::size_t>& owners) {
    return !owners.contains(layer) && !owners.contains(kNobody) && std::ranges::none_of(owners, [&](std::size_t owner) {
      return owner != kSeveral && neighbours_.goes_on(owner, layer);
    });
  }

  /// Pixels of the window beyond the member's sides, from those that go on with them: of the first that has one. Where the member
  /// has heights in place of voids, so have they.
  proto::Result<void> read_beyond(std::size_t member, const RasterSource& own, const PixelWindow& window,
                                  std::vector<double>& heights) {
    for (const VoidRule voids : kByWeight) {
      if (voids == VoidRule::value && own.voids() != voids) continue;
      const auto read = [&](std::size_t other, const PixelWindow& part, std::vector<double>& out) -> proto::Result<void> {
        const auto source = opened(other, voids);
        return source.ok() ? (*source)->own_pixels(part, out) : source.problem();
      };
      if (auto done = fill_beyond(own.all_pixels(), neighbours_.of(member), window, heights, read); !done.ok()) return done;
    }
    return {};
  }

  /// A pole is one point: all of its row that has data gets the height of the first raster that has it, wherever that lies.
  proto::Result<void> level_poles(const proto::Lattice& lattice, proto::Samples& sum) {
    for (const std::int64_t row : {std::int64_t{0}, lattice.rows()}) {
      if (row < sum.south || row >= sum.south + sum.rows) continue;
      const auto height = pole_height(lattice, row);
      if (!height.ok()) return height.problem();
      for (std::int32_t c = 0; c < sum.columns && *height != proto::kNoHeight; ++c) {
        std::int32_t& h = sum.height[static_cast<std::size_t>((row - sum.south) * sum.columns + c)];
        if (h != proto::kNoHeight) h = *height;
      }
    }
    return {};
  }

  proto::Result<std::int32_t> pole_height(const proto::Lattice& lattice, std::int64_t row) {
    const std::pair key{lattice.finest_level, row};
    if (const auto known = pole_heights_.find(key); known != pole_heights_.end()) return known->second;
    std::int32_t height = proto::kNoHeight;
    const std::vector<std::size_t> layers = under({0, row, lattice.columns() - 1, row}, lattice);
    for (const VoidRule voids : kByWeight) {
      if (voids == VoidRule::hole && layers.size() == 1) continue;  // as it is alone
      for (const std::size_t layer : layers) {
        if (height != proto::kNoHeight) break;
        auto source = opened(layer, voids);
        if (!source.ok()) return source.problem();
        const auto one = (*source)->sample(lattice, (*source)->window(lattice).west, row, 1, 1);
        if (!one.ok()) return one.problem();
        height = one->height.front();
      }
    }
    return pole_heights_[key] = height;
  }

  std::vector<MosaicMember> members_;
  double feather_m_;
  std::vector<std::size_t> sheets_;  ///< see sheets_of; empty: nothing is blended
  /// For the pixels that were asked for last: samples of that place are asked for next.
  struct LastLaid {
    int level = 0;
    Window window;
    Laid laid;
  };
  std::optional<LastLaid> last_;
  GridNeighbours neighbours_;
  proto::Source description_;
  mutable std::map<int, Window> windows_;                                      ///< by level; asked for at every empty place
  proto::Lru<std::size_t, std::shared_ptr<RasterSource>> open_{open_files()};  ///< each counts its files
  std::shared_ptr<SharedPixels> lately_;                                       ///< may be null
  std::map<std::pair<int, std::int64_t>, std::int32_t> pole_heights_;          ///< by level and row
};

}  // namespace

std::unique_ptr<Source> make_mosaic(std::vector<MosaicMember> members, double feather_m) {
  return std::make_unique<Mosaic>(std::move(members), feather_m);
}

}  // namespace cordillera::raster
