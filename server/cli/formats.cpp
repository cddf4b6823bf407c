// Names of faces, as a command line has them.
#include <algorithm>
#include <sstream>

#include "pipeline/faces/tiles_3d/glb_tile.h"
#include "server/cli/commands.h"

namespace cordillera::server {
namespace {

// What clients of the first minute need. Everything else can be asked for, and is served on request in any case.
constexpr const char* kUsual = "drc,3d-tiles";

}  // namespace

std::string face_names() {
  std::string names;
  for (const pipeline::faces::Face* face : pipeline::faces::all_faces())
    names.append(names.empty() ? "" : ", ").append(face->name);
  return names;
}

proto::Result<std::vector<const pipeline::faces::Face*>> formats_of(const std::string& names) {
  std::vector<const pipeline::faces::Face*> chosen;
  std::istringstream words(names.empty() ? kUsual : names);
  for (std::string word; std::getline(words, word, ',');) {
    const pipeline::faces::Face* face = pipeline::faces::face_named(word);
    if (face == nullptr)
      return proto::Problem{"usage", "--formats: there is no format '" + word + "'", face_names(), "--formats"};
    if (std::find(chosen.begin(), chosen.end(), face) == chosen.end()) chosen.push_back(face);
  }
  return chosen;
}

proto::Result<pipeline::Normals> normals_of(const std::string& name) {
  auto normals = pipeline::faces::normals_named(name);
  if (!normals)
    return proto::Problem{"usage", "--normals: tiles cannot have '" + name + "'", normals.problem().accepted, "--normals"};
  return normals;
}

}  // namespace cordillera::server
