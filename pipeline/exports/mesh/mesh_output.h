#pragma once
// An extracted mesh as the files that mesh and print programs read.
#include <optional>
#include <ostream>
#include <string>
#include <string_view>
#include <vector>

#include "pipeline/exports/mesh/mesh_extract.h"
#include "proto/result.h"

namespace cordillera::pipeline::exports {

enum class MeshKind : std::uint8_t { glb, ply, obj, stl };

/// "glb" and so on; without a dot, in small letters.
std::optional<MeshKind> mesh_kind(std::string_view ending);
std::string_view media_type(MeshKind kind);
/// All of them.
std::vector<std::string> mesh_endings();
/// ".glb, .ply, .obj or .stl"; last: what stands before the last, " or " here.
std::string mesh_endings_text(std::string_view last);

/// What a format cannot hold is refused: glTF's and STL's 32-bit floats have no room for degrees, nor STL's for earth-centred
/// metres or a map's.
proto::Result<void> check_frame(MeshKind kind, MeshFrame frame);

/// glb: float32 and normals, y up as glTF wants it, earth-centred points, and those of a map, relative to a translation. ply:
/// binary, float32 for local metres, else float64. obj: text, metres to the millimetre. stl: binary. Title, attribution and what
/// coordinates count go where the format has a place. False: the stream failed. frame: one that check_frame lets through.
bool write_mesh(std::ostream& out, const ExtractedMesh& mesh, MeshKind kind, const proto::Manifest& manifest);

// Parts, a file each.
bool write_glb(std::ostream& out, const ExtractedMesh& mesh, const proto::Manifest& manifest);
bool write_stl(std::ostream& out, const ExtractedMesh& mesh, const proto::Manifest& manifest);

}  // namespace cordillera::pipeline::exports
