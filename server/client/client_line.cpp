#include "server/client/client_line.h"

#include "server/options/option_words.h"

namespace cordillera::server::client {
namespace {

void add_place(CLI::App& command, ServiceWords& place) {
  command.add_option("--server", place.server, "the service's address; else CORDILLERA_SERVER, else http://127.0.0.1:8080")
      ->type_name("URL");
  command
      .add_option("--token-file", place.token_file,
                  "a file whose first line is the token; or CORDILLERA_TOKEN, CORDILLERA_TOKEN_FILE")
      ->type_name("FILE");
  command.add_option("--token", place.token, "the token itself, which others can then see in the list of processes")
      ->type_name("TOKEN");
}

void add_show(CLI::App& command, Show& show, Verbosity& words) {
  add_value_flag(command, "--json", show, Show::json, "one line of JSON, of what came out or of the problem");
  add_value_flag(command, "-q,--quiet", words, Verbosity::none, "no progress");
}

/// Options that a service takes from a request.
std::vector<OptionSpec> sent_options() {
  std::vector<OptionSpec> options = post_options();
  std::erase_if(options, [](const OptionSpec& option) { return option.open_to == OpenTo::operators; });
  return options;
}

constexpr const char* kCodes = "Exit codes: 0 done, 1 refused or failed, 2 wrong usage, 75 trying again may help.";

}  // namespace

void ClientWords::add_to(CLI::App& app) {
  add_post(app);
  watch_ = app.add_subcommand("watch", "follow a build on a service until it is ready or has failed");
  watch_->add_option("id", watch_line_.id, "the dataset");
  add_show(*watch_, watch_line_.show, watch_line_.words);
  add_place(*watch_, watch_line_.place);
  watch_->footer(kCodes);
  add_fetch(app);
  add_view(app);
}

void ClientWords::add_post(CLI::App& app) {
  post_ = app.add_subcommand("post", "send a raster to a service, which makes a dataset of it");
  post_->add_option("raster", post_line_.rasters, "the elevation model; or several, the one that wins where they overlap first")
      ->expected(1, -1);
  add_value_flag(*post_, "--wait", post_line_.after, After::wait, "until the dataset is ready or has failed");
  add_value_flag(*post_, "--resume", post_line_.in_parts, true,
                 "in parts, which the same line goes on with after a kill; rasters above 64 MiB always are");
  add_value_flag(*post_, "--updates", post_line_.updates, true,
                 "other rasters may be added to the dataset later; several rasters imply it");
  add_show(*post_, post_line_.show, post_line_.words);
  add_place(*post_, post_line_.place);
  add_table(*post_, sent_options(), post_line_.options);
  post_->footer(kCodes);
}

void ClientWords::add_fetch(CLI::App& app) {
  fetch_ = app.add_subcommand("fetch", "get tiles and documents of a dataset from a service");
  fetch_->add_option("id", fetch_line_.id, "the dataset");
  // No word is needed: the options may say what.
  fetch_->add_option("what", fetch_line_.what, "z/x/y.drc, .glb, .terrain; manifest, tileset; or any address below the dataset's")
      ->expected(0, -1);
  const auto option = [this](const char* name, std::string& value, const char* type, const char* help) {
    fetch_->add_option(name, value, help)->type_name(type);
  };
  option("-o,--output", fetch_line_.output, "PATH",
         "a file, or a folder, where each file gets the path of its address; what has not changed does not come again");
  option("--bbox", fetch_line_.bbox, "BOX", "tiles that meet this box [west,south,east,north in degrees]");
  option("--level", fetch_line_.level, "LEVELS", "of these levels [10 or 8-10]");
  option("--format", fetch_line_.format, "NAME", "what tiles [drc, glb, terrain]");
  fetch_->add_flag("--middle", fetch_line_.middle,
                   "one tile of the finest level, the nearest to the middle of the data; prints its address");
  option("--connections", fetch_line_.connections, "N", "at the same time [1 to 32; default 4]");
  add_show(*fetch_, fetch_line_.show, fetch_line_.words);
  add_place(*fetch_, fetch_line_.place);
  fetch_->footer(kCodes);
}

void ClientWords::add_view(CLI::App& app) {
  view_ = app.add_subcommand("view",
                             "show a raster or what was built of one in the viewer, from a service that ends with the command");
  view_
      ->add_option("path", view_line_.paths,
                   "a raster, a dataset.sqlite, a folder or an archive (.3tz, .pmtiles, .mbtiles) that was built; or several")
      ->expected(1, -1);
  view_->add_option("-p,--port", view_line_.port, "of this machine's loopback [any that is free]")->type_name("PORT");
  add_value_flag(*view_, "--no-browser", view_line_.browser, Browser::stays_shut, "only print the address");
  add_table(*view_, sent_options(), view_line_.options);
}

std::optional<int> ClientWords::run(const std::string& program) const {
  if (*view_) return view_command(view_line_, program);
  if (*post_) return post_command(post_line_);
  if (*watch_) return watch_command(watch_line_);
  if (*fetch_) return fetch_command(fetch_line_);
  return std::nullopt;
}

}  // namespace cordillera::server::client
