#pragma once
// The voids of a source on one lattice: which vertices belong to which, and what fills them. Read piece by piece, as they are
// asked for.
#include <cstdint>
#include <map>
#include <utility>
#include <vector>

#include "raster/source.h"

namespace cordillera::raster {

class VoidMap {
 public:
  /// source outlives the map. limit_cells: see fill_enclosed_voids.
  VoidMap(Source& source, const proto::Lattice& lattice, std::uint32_t limit_cells);

  const proto::Lattice& lattice() const { return lattice_; }
  std::int64_t limit_cells() const { return limit_; }

  /// Puts heights where samples of the source are void and are to be filled, marked kFilledVoid. Columns in any turn.
  proto::Result<void> fill_in(proto::Samples& samples);

 private:
  enum State : std::uint8_t {
    data,
    unknown,  ///< void, and not looked at yet
    seen,     ///< by the search that is under way
    open,     ///< of a void that stays, or outside the source's window
    filled,
  };
  /// A square of vertices.
  struct Chunk {
    std::vector<std::int32_t> height;
    std::vector<State> state;
    std::uint64_t used = 0;  ///< when it was last asked for
  };
  struct Vertex {
    std::int64_t column = 0, row = 0;  ///< column on the turn of where the search began
  };
  /// One void, or as much of it as shows that it stays.
  struct Void {
    std::vector<Vertex> vertices;
    std::int64_t west = 0, south = 0, east = 0, north = 0;
    bool stays = false;
    void add(const Vertex& vertex);
  };

  std::int64_t in_turn(std::int64_t column) const { return column & (lattice_.columns() - 1); }  // a power of two
  proto::Result<Chunk*> chunk_of(const Vertex& vertex);
  static std::size_t index_in_chunk(const Vertex& vertex);
  bool inside(const Vertex& vertex) const;
  proto::Result<void> fill_in(const Vertex& first, std::int32_t count, std::int32_t* height, std::uint8_t* mark);
  proto::Result<void> decide(const Vertex& vertex, Chunk& chunk);
  proto::Result<Void> search(const Vertex& from);
  proto::Result<void> see(const Vertex& vertex, Void& found, std::vector<Vertex>& ahead);
  proto::Result<void> fill(const Void& found);
  void mark(const Void& found, State state);
  void forget_oldest();

  Source& source_;
  proto::Lattice lattice_;
  std::int64_t limit_;
  Source::Window window_;
  using Place = std::pair<std::int64_t, std::int64_t>;
  std::map<Place, Chunk> chunks_;  ///< by row and column of chunks
  Chunk* last_ = nullptr;          ///< asked for last, at last_place_
  Place last_place_;
  std::uint64_t clock_ = 0;
};

}  // namespace cordillera::raster
