#include <algorithm>
#include <filesystem>
#include <iostream>

#include "raster/mosaic/mosaic.h"
#include "server/client/commands.h"
#include "server/client/events.h"
#include "server/client/sender.h"
#include "server/http/percent.h"
#include "server/options/option_values.h"

namespace cordillera::server::client {
namespace {

namespace fs = std::filesystem;
using proto::Problem;

/// Of the options, those that belong to a raster and not to the dataset.
bool is_of_raster(const std::string& name) {
  const std::vector<OptionSpec> own = raster_options();
  return std::any_of(own.begin(), own.end(), [&](const OptionSpec& option) {
    return option.name != "name" && spelt(option.name, Spelling::query) == name;
  });
}

/// As a query spells them: "--vertical-datum" is vertical_datum.
Given as_query(const Given& options) {
  Given query;
  for (const OptionSpec& option : post_options()) {
    for (const auto& [name, value] : options) {
      if (name == spelt(option.name, Spelling::command_line)) query.emplace_back(spelt(option.name, Spelling::query), value);
    }
  }
  return query;
}

std::string query_text(const Given& query) {
  std::string text;
  for (const auto& [name, value] : query) text += (text.empty() ? "" : "&") + name + "=" + percent_encoded(value);
  return text;
}

/// The raster that is sent first, since the first one's levels are the dataset's: the first of the line, or one that is clearly
/// finer, as far as they can be read here.
std::size_t finest_of(const std::vector<std::string>& rasters, const proto::BuildOptions& options) {
  constexpr double kClearly = 0.8;
  std::size_t finest = 0;
  double least_m2 = 0;
  for (std::size_t k = 0; k < rasters.size() && rasters.size() > 1; ++k) {
    const auto seen =
        raster::examine(rasters[k], fs::path(rasters[k]).filename().string(), raster::Trust::operator_file, options);
    if (!seen && raster::lies_beside(seen.problem())) continue;
    if (!seen) return 0;
    // A degree's pixels are narrower towards the poles, and the same level's.
    const double pixel_m2 = seen->description.pixel_height_m() * seen->description.pixel_height_m();
    if (least_m2 == 0 || pixel_m2 < kClearly * least_m2) finest = k, least_m2 = pixel_m2;
  }
  return finest;
}

/// What the service is asked for.
enum class Keeps { dataset, nothing };

class Post {
 public:
  /// first: of the line's rasters, the one that is sent first.
  Post(const PostLine& line, const ServiceAddress& place, std::size_t first, Keeps keeps)
      : line_(line), first_(first), talk_(place, line.words), sender_(talk_, line.words), keeps_(keeps) {}

  /// What the service says of the dataset, or of the dry run.
  proto::Result<Json> run() {
    auto answer = send(line_.rasters[first_], dataset_target());
    if (!answer || keeps_ == Keeps::nothing) return answer;  // an upload in parts stays, for the post that follows
    const std::string id = answer->value("id", "");
    if (id.empty())
      return Problem{"answer-unknown", talk_.address() + " does not name the dataset", "a service of this version", "--server"};
    // Those before it are put before it, one after the other; then the rest.
    for (std::size_t k = 0; k < line_.rasters.size(); ++k) {
      if (k == first_) continue;
      if (auto added = send(line_.rasters[k], source_target(id, k)); !added) {
        Problem problem = added.problem();
        problem.detail += "; dataset " + id + " has " + (first_ == 0 ? "" : line_.rasters[first_] + " and ") +
                          "the rasters before " + line_.rasters[k];
        return problem;
      }
    }
    sender_.forget();
    return answer;
  }
  proto::Result<Json> wait(const std::string& id) {
    ProgressBar bar(ProgressBar::style_of(line_.words == Verbosity::all));
    return follow(talk_, id, bar);
  }
  const std::string& address() const { return talk_.address(); }

 private:
  static std::string name_of(const std::string& path) { return fs::path(path).filename().string(); }

  PostTarget dataset_target() const {
    Given query = as_query(line_.options);
    std::string name = name_of(line_.rasters[first_]);
    bool named = false;
    for (const auto& [key, value] : query) {
      if (key == "name") name = value, named = true;
    }
    if (!named) query.insert(query.begin(), {"name", name});
    if (line_.updates || line_.rasters.size() > 1) query.emplace_back("updates", "1");
    return {"/v1/datasets", query_text(query), name};
  }

  PostTarget source_target(const std::string& id, std::size_t position) const {
    const std::string name = name_of(line_.rasters[position]);
    Given query = {{"name", name}, {"position", std::to_string(position)}};
    for (const auto& option : as_query(line_.options)) {
      if (is_of_raster(option.first) && !is_of_all_rasters(option.first, option.second)) query.push_back(option);
    }
    return {"/v1/datasets/" + id + "/sources", query_text(query), name};
  }

  proto::Result<Json> send(const std::string& path, const PostTarget& target) {
    if (!is_utf8(target.name))
      return Problem{"usage", "the file's name is no UTF-8 text", "--name, or a file with another name", "--name"};
    auto file = LocalFile::open(path);
    if (!file) return file.problem();
    const Way way = line_.in_parts || (*file)->size() > kLarge ? Way::parts : Way::whole;
    return sender_.send(**file, target, way);
  }

  const PostLine& line_;
  const std::size_t first_;
  Talk talk_;
  Sender sender_;
  Keeps keeps_;
};

/// The answer's links, from relative to its own address to whole ones.
Json with_addresses(const Json& answer, const std::string& address) {
  const std::string id = answer.value("id", ""), dataset = address + "/v1/datasets/" + id;
  Json json = {{"id", id}, {"name", answer.value("name", "")}, {"state", answer.value("state", "")}};
  json["links"]["self"] = dataset;
  json["links"]["viewer"] = address + "/?dataset=" + id;
  const Json links = answer.value("links", Json::object());
  for (const auto& [name, link] : links.items()) {
    const std::string text = link.is_string() ? link.get<std::string>() : "";
    const auto at = text.find(id + "/");  // what stands before depends on the document that the link was in
    if (at != text.npos) json["links"][name] = dataset + text.substr(at + id.size());
  }
  return json;
}

void print_line(const Json& json) { std::cout << json.dump(-1, ' ', false, Json::error_handler_t::replace) << std::endl; }

void print(const Json& posted) {
  const auto row = [](const std::string& name, const Json& value) {
    std::cout << name << std::string(name.size() < 10 ? 10 - name.size() : 1, ' ') << value.get<std::string>() << "\n";
  };
  row("id", posted["id"]);
  row("state", posted["state"]);
  for (const auto& [name, link] : posted["links"].items()) row(name, link);
  std::cout << std::flush;
}

/// Until the dataset is ready. As a table the id and the links stand there already: who stops waiting needs them.
int wait_for(Post& post, Json posted, Show show) {
  const auto ready = post.wait(posted["id"]);
  if (show == Show::json) {
    if (ready) posted = with_addresses(*ready, post.address());
    if (!ready) {
      posted["state"] = exit_code(ready.problem()) == kFailed ? "failed" : "unknown";
      posted["error"] = told_json(ready.problem());
    }
    print_line(posted);
    return ready ? kDone : exit_code(ready.problem());
  }
  if (!ready) return tell(ready.problem(), show);
  std::cout << how_it_stands(*ready) << std::endl;
  return kDone;
}

}  // namespace

int post_command(const PostLine& line) {
  const auto settings = with_layer({}, post_options(), line.options, Spelling::command_line);
  if (!settings) return tell(settings.problem(), line.show);
  if (settings->dry_run && (line.rasters.size() > 1 || line.updates)) {
    return tell({"usage", "a dry run of several rasters is the command line's",
                 "cordillera build --dry-run " + line.rasters.front() + " …", "--dry-run"},
                line.show);
  }
  const auto place = find_service(line.place);
  if (!place) return tell(place.problem(), line.show);
  Post post(line, *place, finest_of(line.rasters, settings->build), settings->dry_run ? Keeps::nothing : Keeps::dataset);
  const auto answer = post.run();
  if (!answer) return tell(answer.problem(), line.show);
  if (settings->dry_run) {
    std::cout << answer->dump(line.show == Show::json ? -1 : 2, ' ', false, Json::error_handler_t::replace) << std::endl;
    return kDone;
  }
  const Json posted = with_addresses(*answer, post.address());
  const bool waits = line.after == After::wait;
  if (line.accepted) line.accepted();
  if (line.show == Show::table) print(posted);
  if (line.show == Show::json && !waits) print_line(posted);
  return waits ? wait_for(post, posted, line.show) : kDone;
}

}  // namespace cordillera::server::client
