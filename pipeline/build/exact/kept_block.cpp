#include "pipeline/build/exact/kept_block.h"

#include <zstd.h>

#include <array>
#include <bit>
#include <cstddef>
#include <memory>
#include <new>
#include <span>
#include <stdexcept>
#include <utility>

#include "block.pb.h"
#include "gpu/exact/steps/coded.h"
#include "pipeline/tile/mesh_record.h"

namespace cordillera::pipeline {
namespace {

using gpu::exact::BoundingPlane;

static_assert(std::endian::native == std::endian::little && sizeof(BoundingPlane) == 4 * sizeof(float),
              "planes are stored as they are");

/// A fast one, which still packs codes of few kinds to a seventh: most of what is packed is read soon, and then dropped.
constexpr int kLevel = 1;

/// Piece by piece, so that nothing but what is packed takes memory: to have it anew takes as long as to pack.
class Packer {
 public:
  explicit Packer(std::size_t bytes) {
    if (!context_) throw std::bad_alloc();
    check(ZSTD_CCtx_setParameter(context_.get(), ZSTD_c_compressionLevel, kLevel));
    check(ZSTD_CCtx_setPledgedSrcSize(context_.get(), bytes));
  }
  void add(std::span<const std::byte> piece) { run(piece, ZSTD_e_continue); }
  std::string end() {
    run({}, ZSTD_e_end);
    return std::move(packed_);
  }

 private:
  void run(std::span<const std::byte> piece, ZSTD_EndDirective directive) {
    ZSTD_inBuffer in{piece.data(), piece.size(), 0};
    for (std::size_t left = 1; left > 0 || in.pos < in.size;) {
      ZSTD_outBuffer out{room_.data(), room_.size(), 0};
      left = check(ZSTD_compressStream2(context_.get(), &out, &in, directive));
      packed_.append(room_.data(), out.pos);
      if (directive == ZSTD_e_continue) left = 0;  // what it holds back comes with more
    }
  }
  static std::size_t check(std::size_t result) {
    if (ZSTD_isError(result)) throw std::runtime_error(std::string("zstd: ") + ZSTD_getErrorName(result));
    return result;
  }

  struct Free {
    void operator()(ZSTD_CCtx* context) const { ZSTD_freeCCtx(context); }
  };
  const std::unique_ptr<ZSTD_CCtx, Free> context_{ZSTD_createCCtx()};
  std::array<char, 1 << 15> room_{};
  std::string packed_;
};

template <class Row>
std::string pack(const Row& row) {
  const auto bytes = std::as_bytes(std::span(row));
  Packer packer(bytes.size());
  packer.add(bytes);
  return packer.end();
}

/// False: that is not what is packed there.
template <class Row>
bool unpack(const std::string& packed, std::size_t count, Row& row) {
  row.resize(count);
  const std::size_t bytes = count * sizeof(row[0]);
  return ZSTD_decompress(row.data(), bytes, packed.data(), packed.size()) == bytes;
}

/// Made coarser on the way.
std::string pack_codes(const gpu::exact::Squares& squares, float unit) {
  constexpr int kCodes = 256, kTables = 8;  // of 0, 1, 3 … 127 steps
  std::array<std::array<std::uint8_t, kCodes>, kTables> tables;
  for (int t = 0; t < kTables; ++t) {
    for (int code = 0; code < kCodes; ++code)
      tables[t][code] = gpu::exact::coarser_code(static_cast<std::uint8_t>(code), (1 << t) - 1);
  }
  Packer packer(squares.code.size());
  std::array<std::uint8_t, 1 << 14> piece;
  std::size_t filled = 0;
  for (std::size_t s = 0; s < squares.plane.size(); ++s) {
    const int steps = gpu::exact::code_steps(squares.plane[s].off, unit);
    const std::uint8_t* const from = &squares.code[64 * s];
    std::uint8_t* const to = &piece[filled];
    if (steps == 0) {  // of most squares on most ground: without a table it is done at once
      for (int k = 0; k < 64; ++k) to[k] = gpu::exact::coarser_code(from[k], 0);
    } else {
      const auto& table = tables[std::bit_width(static_cast<unsigned>(steps))];
      for (int k = 0; k < 64; ++k) to[k] = table[from[k]];
    }
    filled += 64;
    if (filled < piece.size() && s + 1 < squares.plane.size()) continue;
    packer.add(std::as_bytes(std::span(piece).first(filled)));
    filled = 0;
  }
  return packer.end();
}

}  // namespace

std::string to_bytes(const KeptBlock& block, float code_unit) {
  proto::KeptBlock record;
  *record.mutable_mesh() = record_of_mesh(block.mesh);
  const gpu::exact::Squares& squares = block.squares;
  record.set_planes(pack(squares.plane));
  record.set_codes(pack_codes(squares, code_unit));
  if (!squares.depth.empty()) record.set_depths(pack(squares.depth));
  record.set_code_unit(code_unit);
  return record.SerializeAsString();
}

proto::Result<KeptBlock> kept_block_from(const std::string& bytes, std::int64_t side, float code_unit, KeptParts parts) {
  const proto::Problem damaged{"store-damaged", "what a block left for the levels above it cannot be read",
                               "a dataset built anew", ""};
  proto::KeptBlock record;
  if (!record.ParseFromString(bytes) || record.mesh().side() != side || record.code_unit() != code_unit) return damaged;
  KeptBlock block;
  if (parts != KeptParts::squares) {
    auto mesh = mesh_of_record(record.mesh());
    if (!mesh) return damaged;
    block.mesh = std::move(*mesh);
  }
  if (parts == KeptParts::mesh) return block;
  gpu::exact::Squares& squares = block.squares;
  const std::size_t across = static_cast<std::size_t>(side) / 8 + 1, count = across * across;
  const bool whole = unpack(record.planes(), count, squares.plane) && unpack(record.codes(), 64 * count, squares.code) &&
                     (record.depths().empty() || unpack(record.depths(), count, squares.depth));
  return whole ? proto::Result<KeptBlock>(std::move(block)) : damaged;
}

}  // namespace cordillera::pipeline
