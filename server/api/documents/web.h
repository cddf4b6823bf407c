#pragma once
// The viewer's files, and a plain page in their place.
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "server/datasets/registry.h"
#include "server/http/message.h"
#include "server/http/web_files.h"

namespace cordillera::server {

/// Where the build or the installation puts the viewer: <program's folder>/../share/web or ../share/cordillera/web. May not
/// exist.
std::string default_web_folder(const std::string& program);

/// The file of a path like /, /index.html or /assets/viewer.js. Nothing outside the folder is ever read.
/// Where the build left FILE.br beside a file, clients that accept br get that: a script of megabytes takes seconds to compress.
/// Without a viewer, / is a page that says what is missing and lists the datasets that datasets() gives; nothing else asks for
/// them.
Response page(WebFiles& files, const std::string& folder, const Request& request,
              const std::function<std::vector<Row>()>& datasets);

/// A file below a folder as it is. type: Content-Type; cached: Cache-Control. nullopt: there is none, or the path leads out of
/// the folder.
std::optional<Response> file_of_folder(WebFiles& files, const std::string& folder, const std::string& path,
                                       const std::string& type, const char* cached);

/// demo/CLIENT.html of the folder: a map library with a dataset in it. The page knows its dataset by its own address, so it is
/// the same for every id, also for one that there is not, and tells nobody which private ones there are.
Response demo_page(WebFiles& files, const std::string& folder, const std::string& path);

}  // namespace cordillera::server
