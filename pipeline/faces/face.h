#pragma once
// One store, many faces. A face is what one family of clients fetches: paths below the dataset's own, and for each a function
// that makes what stands there from the published store. The table of all faces is what the server routes by, what a static
// folder is written from, and what the API's description lists.
#include <concepts>
#include <cstdint>
#include <functional>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <utility>

#include "pipeline/faces/terrain.h"
#include "pipeline/store/store.h"
#include "proto/result.h"

namespace cordillera::pipeline::faces {

/// The media type of Mapbox Vector Tiles.
inline constexpr std::string_view kVectorTile = "application/vnd.mapbox-vector-tile";

/// What the braces of a path held, and the query of a picture, of lines or of 3D Tiles.
struct Place {
  char root = 0;  ///< 'W' or 'E'; 0 where the path has none
  int z = 0;
  std::int32_t x = 0, y = 0;
  std::string_view ramp{};      ///< ramp= of a resource that takes it, not copied; empty: the style's own
  std::string_view interval{};  ///< interval= of a resource that takes it, not copied; empty: the zoom's own
  std::string_view normals{};   ///< normals= in the same way; empty: those of the vertices
};

/// What a path's z, x and y count.
enum class Grid : std::uint8_t {
  none,                ///< the path has no tile
  geodetic,            ///< two tiles at level 0, y from the south
  implicit,            ///< levels below the root W or E, y from the south
  web_mercator,        ///< one tile at level 0, y from the north
  web_mercator_south,  ///< the same tiles, y from the south
};
inline bool is_mercator(Grid grid) { return grid == Grid::web_mercator || grid == Grid::web_mercator_south; }

/// Makes a document. Nothing where the place has no tile; a problem where the dataset or the machine cannot give any.
using Make = proto::Result<std::optional<Document>> (*)(const Terrain& terrain, const Place& place);

/// A document's tag at the cost of looking it up; nothing where the place has no tile.
using Tag = std::optional<std::string> (*)(const Terrain& terrain, const Place& place);

/// What a document's links are.
enum class Links : std::uint8_t {
  relative,        ///< to the document; whoever reads it resolves them
  tile_templates,  ///< JSON whose "tiles" are relative here; readers take them as they stand, so a server puts its own address
                   ///< before them
};
/// How a server answers where a resource has no tile.
enum class Absent : std::uint8_t {
  not_found,   ///< with a problem that says where there are tiles
  no_content,  ///< with nothing: pages that show pictures take a refusal for an error
};

/// What a server may do to the bytes for a client that accepts it, beside JSON, text and vector tiles, which are always
/// compressed.
enum class Compression : std::uint8_t { none, gzip };

/// A document, or all tiles of one kind.
struct Resource {
  std::string_view path;  ///< "terrain/{z}/{x}/{y}.terrain"; the braces are root, z, x and y, each once at most
  Grid grid = Grid::none;
  std::string_view type;   ///< media type
  std::string_view about;  ///< one line for the API's description
  Make make = nullptr;
  Links links = Links::relative;
  Absent absent = Absent::not_found;
  Compression compression = Compression::none;
  Tag tag = nullptr;             ///< null: only making the document tells
  std::string_view ramps{};      ///< what ?ramp= accepts; empty: the resource takes none
  std::string_view normals{};    ///< what ?normals= accepts, in the same way
  std::string_view intervals{};  ///< what ?interval= accepts, in the same way
};

/// Which paths of a face are named.
enum class Named : std::uint8_t {
  shown,     ///< those that have something
  expected,  ///< also tiles that only drawing tells to be empty: none is drawn. For those who want to know how many about there
             ///< are
};

/// How paths are found. threads: that may find out what has something; 0: one for each usable core.
struct Listing {
  Listing(unsigned with_threads = 1, Named which = Named::shown) : threads(with_threads), named(which) {}
  unsigned threads;
  Named named;
};

/// Is given every path of a face that has something, in an order that depends on the dataset alone, by the caller's thread.
class PathSink {
 public:
  template <class Take>
  requires std::invocable<const Take&, const std::string&> PathSink(Take take, Listing listing = {})
      : take_(std::move(take)), listing_(listing) {}
  void operator()(const std::string& path) const { take_(path); }
  unsigned threads() const { return listing_.threads; }
  Named named() const { return listing_.named; }

 private:
  std::function<void(const std::string& path)> take_;
  Listing listing_;
};

struct Face {
  std::string_view name;   ///< as formats= has it
  std::string_view about;  ///< which clients read it; one line
  std::string_view entry;  ///< the path that a client is given
  std::span<const Resource> resources;
  void (*each_path)(const Terrain& terrain, const PathSink& sink) = nullptr;  ///< memory does not grow with the dataset
};

/// In the order in which they are listed. The first ones are what a static folder holds unless told otherwise.
std::span<const Face* const> all_faces();
const Face* face_named(std::string_view name);
/// Whether it has nothing but tiles of Web Mercator, and documents about them.
bool is_of_maps(const Face& face);

struct Found {
  const Resource* resource = nullptr;
  Place place;
};
/// Which resource a path names. Numbers are plain decimals without sign or leading zeros: a tile has one name. The place may lie
/// outside the grid.
std::optional<Found> find(std::string_view path);
/// Whether the grid has such a place; make is only to be asked for those.
bool inside(Grid grid, const Place& place);

/// The path of a resource at a place.
std::string path_of(const Resource& resource, const Place& place);

}  // namespace cordillera::pipeline::faces
