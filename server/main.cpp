// The command line. Every option of `build` and `serve` comes from the one table in options.h.
#include <CLI/CLI.hpp>
#include <filesystem>
#include <functional>

#include "server/child.h"
#include "server/commands.h"

namespace {

using namespace cordillera;
using namespace cordillera::server;

/// The options of one command as CLI11 reads them.
struct Reading {
  Given given;
  std::string config;
};

void add_options(CLI::App& command, const std::vector<OptionSpec>& table, Reading& reading) {
  for (const OptionSpec& option : table) {
    const std::string name = spelt(option, Spelling::command_line);
    const auto take = [&reading, name](const CLI::results_t& values) {
      for (const std::string& value : values) reading.given.emplace_back(name, value);
      return true;
    };
    auto* added = command.add_option(name, take, option.help + " [" + option.accepted + "]");
    added->type_name(option.value)->multi_option_policy(CLI::MultiOptionPolicy::TakeAll);
    if (option.value.empty()) {
      added->expected(0, 1);
    } else {
      added->expected(1)->allow_extra_args(false);
    }
  }
  command.add_option("--config", reading.config, "file with lines of name = value")->type_name("FILE");
  command.footer(
      "Options also come from the environment (CORDILLERA_ERROR=2 …) and from the config file; the command line wins.");
  command.allow_extras();
}

/// Defaults, then the config file, then the environment, then the command line.
proto::Result<Settings> settings_from(const std::vector<OptionSpec>& table, const Reading& reading) {
  Settings settings;
  if (!reading.config.empty()) {
    auto lines = config_file_layer(reading.config);
    if (!lines) return lines.problem();
    auto layered = with_layer(settings, table, *lines, Spelling::config_file);
    if (!layered) {
      proto::Problem problem = layered.problem();
      problem.detail = reading.config + ": " + problem.detail;
      return problem;
    }
    settings = *layered;
  }
  auto layered = with_layer(settings, table, environment_layer(table), Spelling::environment);
  if (!layered) return layered.problem();
  return with_layer(*layered, table, reading.given, Spelling::command_line);
}

int wrong_usage(const proto::Problem& problem) {
  complain(problem);
  return kUsage;
}

/// An option nobody knows is a problem that names its neighbour; a word too many likewise.
std::optional<proto::Problem> check_extras(const CLI::App& command, const std::vector<OptionSpec>& table) {
  for (const std::string& word : command.remaining()) {
    if (word.rfind("--", 0) != 0) {
      return proto::Problem{"usage", "unexpected '" + word + "'", "see cordillera " + command.get_name() + " --help", word};
    }
    const auto unknown = with_layer({}, table, {{word.substr(0, word.find('=')), ""}}, Spelling::command_line);
    if (!unknown) return unknown.problem();
  }
  return std::nullopt;
}

/// Runs a command with what its options say, or tells what is wrong with them.
int with_settings(const CLI::App& command, const std::vector<OptionSpec>& table, const Reading& reading,
                  const std::function<int(const Settings&)>& run) {
  if (auto extra = check_extras(command, table)) return wrong_usage(*extra);
  const auto settings = settings_from(table, reading);
  if (!settings) return wrong_usage(settings.problem());
  try {
    return run(*settings);
  } catch (const std::exception& error) {
    complain({"internal", std::string("this should not have happened: ") + error.what(), "", ""});
    return kFailed;
  }
}

std::string own_path() {
  std::error_code error;
  return std::filesystem::read_symlink("/proc/self/exe", error).string();
}

}  // namespace

int main(int count, char** words) {
  CLI::App app{"Cordillera: terrain level-of-detail tiles from digital elevation models", "cordillera"};
  app.set_version_flag("--version", std::string("cordillera ") + CORDILLERA_VERSION);
  app.require_subcommand(1);

  Reading serve_reading, build_reading;
  auto* serve = app.add_subcommand("serve", "run the HTTP service; build options are the defaults of its requests");
  const std::vector<OptionSpec> serve_table = all_options();
  add_options(*serve, serve_table, serve_reading);

  std::string raster, output;
  auto* build = app.add_subcommand("build", "make a static folder of tiles that any web server can host");
  build->add_option("raster", raster, "the elevation model: GeoTIFF, COG, .hgt, Esri ASCII or USGS DEM")->required();
  build->add_option("-o,--output", output, "folder to write, or a file called *.sqlite");
  add_options(*build, build_options(), build_reading);

  std::string subject;
  bool as_json = false;
  auto* info = app.add_subcommand("info", "print the manifest of a folder or dataset that was built");
  info->add_option("path", subject, "a folder that build wrote, or a dataset.sqlite")->required();
  info->add_flag("--json", as_json, "the manifest itself");

  std::string tile;
  auto* decode = app.add_subcommand("decode", "check a .drc or .glb tile: decode it and count");
  decode->add_option("tile", tile, "a tile file")->required();

  std::string folder;
  int parent = 0;
  auto* job = app.add_subcommand("job", "")->group("");
  job->add_option("folder", folder)->required();
  job->add_option("--parent", parent);

  try {
    app.parse(count, words);
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? kDone : kUsage;
  }
  if (*job) return job_main(folder, parent);
  if (*decode) return decode_command(tile);
  if (*info) return info_command(subject, as_json ? Show::json : Show::table);

  if (*build) {
    return with_settings(*build, build_options(), build_reading, [&](const Settings& settings) {
      if (!output.empty() || settings.dry_run) return build_command(settings, raster, output);
      return wrong_usage({"usage", "build needs to know where to write", "-o FOLDER or -o FILE.sqlite", "--output"});
    });
  }
  return with_settings(*serve, serve_table, serve_reading,
                       [](const Settings& settings) { return serve_command(settings, own_path()); });
}
