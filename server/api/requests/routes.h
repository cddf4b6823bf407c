#pragma once
// The table of routes, and which of them a path names. The table itself stands where the handlers are: api/route_table.cpp.
#include <functional>
#include <string>
#include <string_view>
#include <vector>

#include "pipeline/faces/face.h"
#include "server/http/dataset_id.h"
#include "server/http/message.h"
#include "server/http/role.h"

namespace cordillera::server {

class Service;
struct Route;

inline constexpr std::string_view kOneDataset = "/v1/datasets/{id}", kOfFaces = "{resource}";

using Handler = std::function<Response(Service& service, const Request& request, const Route& route)>;

/// One method of a resource. That of GET answers HEAD, too; OPTIONS is answered for all alike.
struct RouteMethod {
  std::string_view name;       ///< "GET"
  access::Role needs;          ///< of who asks; who posted a dataset is looked at by the handler
  std::string_view operation;  ///< its name in the API's description, which has words for it
  Handler handler;
};

/// A resource. Braces: `id`, of a dataset or an upload; `source` and `client`, spelt like ids; `mesh_format`; `resource`: what
/// faces have.
struct RouteRow {
  /// What it is beside its path.
  enum Is : unsigned {
    kPlain = 0,
    kVersioned = 1,    ///< stands below a version of the dataset, too, where it never changes
    kLive = 2,         ///< stands below /v1/live, too, to be read
    kTerrain = 4,      ///< is made of what was built: who asks for it uses the dataset
    kOneAddress = 8,   ///< of /v1/live: leads to the dataset's own address, for it goes on for long or has relative links
    kQuick = 16,       ///< only looked up, in microseconds
    kLarge = 32,       ///< may be megabytes that are made for this client alone
    kTus = 64,         ///< OPTIONS tells what uploads in parts may be
    kTried = 128,      ///< people send rasters here who do not know where they go
    kElsewhere = 256,  ///< every path that no other row has, outside of /v1 and /stac
  };

  std::string_view path;  ///< "/v1/datasets/{id}/events"
  std::string_view name;  ///< for metrics and logs, of several rows perhaps; faces have their own
  std::string_view tag;   ///< its group in the API's description
  unsigned is;            ///< of Is
  std::vector<RouteMethod> methods;

  /// Null: the resource does not answer it. OPTIONS is not asked for here.
  const RouteMethod* method(std::string_view asked) const;
};

/// All of them: what is answered, Allow, roles, names in metrics and the API's description follow from it.
const std::vector<RouteRow>& route_table();

struct Route {
  const RouteRow* row = nullptr;  ///< null: there is nothing at the path
  std::string id;
  std::string version;           ///< of …/{id}/versions/{version}/…; empty without one
  std::string path;              ///< what follows …/{id}/ or the version; of live, what follows /v1/live/, or ".pmtiles"
  std::string item;              ///< `source` or `client` of the path
  pipeline::faces::Found found;  ///< of a face's resource; else its resource is null

  bool is(RouteRow::Is what) const { return row != nullptr && (row->is & what) != 0; }
};

/// A path of the API that is spelt wrongly has no row; everything outside of it is a page.
Route parse_route(std::string_view path);

/// For metrics and logs: one name for all addresses of a resource; a face's own.
std::string route_name(const Route& route);

/// The methods that are answered there, as the Allow header has them.
std::string allowed_methods(const Route& route);
/// The role that it takes; HEAD and OPTIONS take what a GET does. A method that the resource does not answer: none to read, else
/// what a POST takes, and write where there is no POST.
access::Role role_needed(const std::string& method, const Route& route);
/// Whether the method only reads this resource.
bool only_reads(const std::string& method, const Route& route);

}  // namespace cordillera::server
