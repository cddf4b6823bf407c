// The command line. Every option of `build` and `serve` comes from the one table in options.h.
#include <CLI/CLI.hpp>
#include <algorithm>
#include <filesystem>
#include <functional>
#include <iostream>
#include <locale>

#include "raster/disk/share_folder.h"
#include "server/jobs/child.h"
#include "server/client/client_line.h"
#include "server/cli/commands.h"
#include "server/doctor/doctor.h"
#include "server/cli/export_command.h"
#include "server/cli/path_kind.h"
#include "server/options/mesh_options.h"
#include "server/options/option_words.h"
#include "server/options/shell_words.h"
#include "server/cli/simplify_command.h"
#include "server/options/spoken_words.h"
#include "server/cli/token_command.h"
#include "server/cli/work_line.h"

namespace {

using namespace cordillera;
using namespace cordillera::server;

/// The options of one command as CLI11 reads them.
struct Reading {
  Given given;
  std::string config;
};

void add_options(CLI::App& command, const std::vector<OptionSpec>& table, Reading& reading) {
  add_table(command, table, reading.given);
  command.add_option("--config", reading.config, "file with lines of name = value")->type_name("FILE");
  command.footer(
      "Options also come from the environment (CORDILLERA_ERROR=2 …) and from the config file; the command line wins.");
}

/// --host and --port, the halves of --listen. The command line's alone: an orchestrator sets CORDILLERA_PORT for reasons of its own, to
/// tcp://10.0.0.1:8080.
struct ListenWords {
  std::string host, port;
  void add_to(CLI::App& command) {
    command.add_option("--host", host, "the address of --listen [such as 0.0.0.0]")->type_name("HOST");
    command.add_option("-p,--port", port, "the port of --listen")->type_name("PORT");
  }
  /// As if --listen had been given.
  void put(Reading& reading) const {
    if (!host.empty() || !port.empty()) reading.given.emplace_back("--listen", listen_address(host, port));
  }
};

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

int say(const std::string& text) {
  std::cout << text << std::flush;
  return std::cout ? kDone : kFailed;
}

/// A command nobody knows is a problem that names its neighbour.
proto::Problem unknown_command(const std::string& word, const std::vector<std::string>& names) {
  std::string all;
  for (const std::string& name : names) all += (all.empty() ? "" : ", ") + name;
  const auto nearest = nearest_name(word, names);
  return {"usage", "unknown command '" + word + "'" + (nearest ? "; did you mean " + *nearest + "?" : ""), all, word};
}

/// The same of an option. A command has up to a hundred: help has them in groups, one line has not.
proto::Problem unknown_option(const std::string& word, const std::vector<std::string>& names, const std::string& command) {
  const auto nearest = nearest_name(word, names);
  return {"usage", "unknown option '" + word + "'; " + (nearest ? "did you mean " + *nearest + "?" : "see `cordillera help " + command + "`"), "", word};
}

/// The first word that is no command, if there is one.
std::optional<proto::Problem> check_command(const CLI::App& app, const std::string& word) {
  if (word.empty() || word[0] == '-') return std::nullopt;
  std::vector<std::string> names;
  for (const CLI::App* command : app.get_subcommands(nullptr)) {
    if (command->get_name() == word) return std::nullopt;
    if (!command->get_group().empty()) names.push_back(command->get_name());
  }
  return unknown_command(word, names);
}

/// What the command did not take: an option nobody knows, or a word too many. A command that lacks a word cannot run either.
std::optional<proto::Problem> check_words(const CLI::App& command) {
  std::vector<std::string> names;
  for (const CLI::Option* option : command.get_options()) {
    for (const std::string& name : option->get_lnames()) names.push_back("--" + name);
  }
  const std::string help = "see cordillera " + command.get_name() + " --help";
  for (const std::string& word : command.remaining()) {
    if (word.rfind("-", 0) == 0) return unknown_option(word.substr(0, word.find('=')), names, command.get_name());
    return proto::Problem{"usage", "unexpected '" + word + "'", help, word};
  }
  for (const CLI::Option* option : command.get_options()) {
    if (!option->get_positional() || option->count() > 0 || option->get_expected_min() == 0) continue;
    return proto::Problem{"usage", command.get_name() + " needs a " + option->get_name(true), help, option->get_name(true)};
  }
  return std::nullopt;
}

/// Runs a command with what its options say, or tells what is wrong with them.
int with_settings(const std::vector<OptionSpec>& table, const Reading& reading, const std::function<int(const Settings&)>& run) {
  for (const std::string& sentence : unread_variables()) std::cerr << "cordillera: warning: " << sentence << "\n";
  const auto settings = settings_from(table, reading);
  if (!settings) return wrong_usage(settings.problem());
  try {
    return run(*settings);
  } catch (const std::exception& error) {
    complain({"internal", std::string("this should not have happened: ") + error.what(), "", ""});
    return kFailed;
  }
}

CLI::App* add_simplify(CLI::App& app, SimplifyLine& line) {
  auto* simplify = app.add_subcommand("simplify", "make a height-field mesh smaller: x and y in the plan, z up");
  simplify->add_option("mesh", line.input, "PLY, OFF or OBJ");
  const auto option = [simplify](const std::string& names, std::string& value, const std::string& type, const std::string& help) {
    simplify->add_option(names, value, help)->type_name(type);
  };
  option("-o,--output", line.output, "FILE", "what to write: .ply, .off or .obj");
  option("--keep", line.keep, "SHARE", "keep this share of the triangles [above 0, up to 1]");
  option("--triangles", line.triangles, "N", "keep so many triangles [1 or more]");
  option("--error", line.error, "METRES", "keep as few as stay within this distance of every vertex, along z [0 or more]");
  option("--quality", line.quality, "QUALITY", "what the time is spent on [fast, default, best, minimax]");
  option("--strategy", line.strategy, "STRATEGY", "how [waves; cleap, sequential: the published algorithm]");
  option("--collapses", line.collapses, "N", "cleap, sequential: collapse so many edges [1 or more]");
  option("--device", line.device, "DEVICE", "what computes [auto, cpu, cuda, cuda:N]");
  option("--threads", line.threads, "N", "threads that measure the result; 0: as many as the machine has [0 to 1024]");
  for (const CleapOption& known : cleap_options()) {
    const auto take = [&line, name = known.name](const std::string& value) { line.cleap[name] = value; };
    const std::string help = "cleap, sequential: " + known.help + " [" + known.accepted + "]";
    simplify->add_option_function<std::string>("--" + known.name, take, help)->type_name(known.value);
  }
  simplify->add_flag_callback("--json", [&line] { line.show = Show::json; }, "the report as JSON");
  return simplify;
}

constexpr const char* kNormalsHelp = "light of 3D Tiles: normals of vertices, a normal map, or nothing [vertex, texture, none; default vertex]";

CLI::App* add_export(CLI::App& app, ExportLine& line) {
  auto* command = app.add_subcommand("export", "write a dataset as one file, or a part of it as one mesh");
  command->add_option("source", line.source, "a dataset.sqlite, or a dataset's folder in a server's data");
  command->add_option("-o,--output", line.output, "what to write: .pmtiles, .mbtiles, .3tz, or a mesh: .glb, .ply, .obj, .stl")->type_name("FILE");
  command->add_option("--format", line.format, "which tiles an archive holds [" + face_names() + "]")->type_name("NAME");
  command->add_option("--normals", line.normals, kNormalsHelp)->type_name("NAME");
  for (const MeshOption& option : mesh_options()) {
    const std::string name = "--" + option.name;
    const auto take = [&line, name](const CLI::results_t& values) {
      for (const std::string& value : values) line.mesh.emplace_back(name, value);
      return true;
    };
    auto* added = command->add_option(name, take, option.help + " [" + option.accepted + "]");
    added->type_name(option.value)->expected(1)->allow_extra_args(false)->multi_option_policy(CLI::MultiOptionPolicy::TakeAll);
  }
  command->add_option("--max-triangles", line.most_triangles, "most triangles of a mesh [1 to 100000000; default 10000000]")->type_name("N");
  command->add_flag_callback("--overwrite,--force", [&line] { line.other = pipeline::Existing::replace; }, "replace a file that is there");
  command->add_flag_callback("-q,--quiet", [&line] { line.words = Words::none; }, "say nothing but problems");
  return command;
}

CLI::App* add_token(CLI::App& app, TokenWords& words) {
  auto* command = app.add_subcommand("token", "make a token for who may write to a service");
  command->add_option("action", words.action, "new");
  command->add_option("--name", words.name, "who gets it; stands in logs")->type_name("NAME");
  command->add_option("--role", words.role, "what it allows [read, write, admin]")->type_name("ROLE");
  command->add_option("--file", words.file, "add its line to this file, that of serve --tokens")->type_name("FILE");
  return command;
}

std::string own_path() {
  std::error_code error;
  return std::filesystem::read_symlink("/proc/self/exe", error).string();
}

/// std::regex, which the HTTP library uses too, asks for these tables, and libstdc++ fills them at their first use without a lock (its bug
/// 77704): to be called before the first thread.
void fill_tables_of_letters() {
  const auto& letters = std::use_facet<std::ctype<char>>(std::locale());
  const char from = 'a';
  char to = 0;
  letters.narrow(&from, &from + 1, ' ', &to);
  letters.widen(&from, &from + 1, &to);
}

}  // namespace

int main(int count, char** words) {
  fill_tables_of_letters();
  raster::fit_private_libraries();
  CLI::App app{"Cordillera: terrain level-of-detail tiles from digital elevation models", "cordillera"};
  app.set_version_flag("--version", std::string("cordillera ") + CORDILLERA_VERSION);
  app.require_subcommand(1);

  Reading serve_reading, build_reading, info_reading;
  auto* serve = app.add_subcommand("serve", "run the HTTP service; build options are the defaults of its requests");
  const std::vector<OptionSpec> serve_table = all_options();
  add_options(*serve, serve_table, serve_reading);
  ListenWords listen;
  listen.add_to(*serve);

  BuildLine line;
  bool overwrite = false, quiet = false;
  std::string formats, normals;
  auto* build = app.add_subcommand("build", "make a static folder of tiles that any web server can host");
  build->add_option("raster", line.rasters, "the elevation model: GeoTIFF, .hgt, NetCDF, .img, DTED, XYZ or another, also in a .zip or .gz; or several, folders and lists of them, "
                    "the one that wins where they overlap first")->expected(1, -1);
  constexpr const char* kOutput = "Output";  // a group of the table's, too
  build->add_option("-o,--output", line.output, "folder to write; or a file, by its name: .sqlite, .pmtiles, .mbtiles, .3tz, or a mesh (.glb, .ply, .obj, .stl)")->group(kOutput);
  build->add_flag("--overwrite,--force", overwrite, "replace another build that is there; without it, only an unfinished one of the same "
                  "raster and options goes on")->group(kOutput);
  build->add_option("--formats", formats, "what the folder holds [" + face_names() + "; more than one separated by commas]")->type_name("NAMES")->group(kOutput);
  build->add_option("--normals", normals, kNormalsHelp)->type_name("NAME")->group(kOutput);
  build->add_flag("-q,--quiet", quiet, "say nothing but problems");
  add_options(*build, build_options(), build_reading);

  std::string subject;
  bool as_json = false;
  auto* info = app.add_subcommand("info", "print the manifest of a folder or dataset that was built, or what a raster is and what a build with these options would make");
  info->add_option("path", subject, "a folder that build wrote, a dataset.sqlite, or a raster");
  info->add_flag("--json", as_json, "the manifest itself; of a raster, the dry run");
  add_options(*info, build_options(), info_reading);

  std::string tile;
  auto* decode = app.add_subcommand("decode", "check a .drc or .glb tile: decode it and count");
  decode->add_option("tile", tile, "a tile file");

  SimplifyLine simplify_line;
  auto* simplify = add_simplify(app, simplify_line);

  ExportLine export_line;
  auto* export_file = add_export(app, export_line);

  WorkWords work_words;
  work_words.add_to(app);
  Reading plan_reading;
  add_options(*work_words.plan(), build_options(), plan_reading);

  client::ClientWords client_words;
  client_words.add_to(app);

  CheckLine check_line;
  auto* check = app.add_subcommand("check", "verify a dataset: every checksum, record, border and bound; the exit code says what came out");
  check->add_option("path", check_line.path, "a dataset.sqlite, a dataset's folder, a folder that build wrote, or a server's data folder");
  check->add_option("--source", check_line.source, "the raster it was built from: stated errors are measured against it")->type_name("RASTER");
  check->add_flag_callback("--json", [&check_line] { check_line.show = Show::json; }, "the report as JSON");

  std::string data, backup_place;
  auto orphans = Orphans::keep;
  auto* vacuum = app.add_subcommand("vacuum", "remove from a stopped server's data folder what nothing names, and give free pages back");
  vacuum->add_option("data", data, "the data folder");
  vacuum->add_flag_callback("--orphans", [&orphans] { orphans = Orphans::remove; }, "also remove folders that were set aside because no dataset could be made of them");
  auto* adopt = app.add_subcommand("adopt", "make a new registry for a stopped server's data folder whose registry is lost");
  adopt->add_option("data", data, "the data folder");
  auto* backup = app.add_subcommand("backup", "copy a server's data folder while the server runs");
  backup->add_option("data", data, "the data folder");
  backup->add_option("-o,--output", backup_place, "a folder that does not exist yet")->type_name("FOLDER");
  auto* restore = app.add_subcommand("restore", "make a data folder from a backup");
  restore->add_option("backup", backup_place, "a folder that backup wrote");
  restore->add_option("--data", data, "the data folder to make [cordillera-data]")->type_name("FOLDER");

  TokenWords token_words;
  auto* token = add_token(app, token_words);

  Reading doctor_reading;
  auto doctor_output = doctor::Output::lines;
  auto* doctor = app.add_subcommand("doctor", "look whether this machine is fit to serve; takes the options of serve");
  add_options(*doctor, serve_table, doctor_reading);
  listen.add_to(*doctor);
  doctor->add_flag_callback("--json", [&doctor_output] { doctor_output = doctor::Output::json; }, "the findings as JSON");

  std::string shell;
  auto* completion = app.add_subcommand("completion", "print completions for a shell: source <(cordillera completion bash)");
  completion->add_option("shell", shell, "bash, zsh or fish");
  auto* manual = app.add_subcommand("man", "print the manual page: cordillera man | man -l -");

  std::string folder;
  int parent = 0;
  std::uint32_t free_percent = 0;
  auto* job = app.add_subcommand("job", "")->group("");
  job->add_option("folder", folder)->required();
  job->add_option("--parent", parent);
  job->add_option("--free-percent", free_percent);

  for (CLI::App* command : {serve, build, info, decode, simplify, export_file, check, adopt, vacuum, backup, restore, completion, manual}) command->allow_extras();
  for (CLI::App* command : work_words.commands()) command->allow_extras();
  for (CLI::App* command : client_words.commands()) command->allow_extras();
  std::vector<std::string> line_words = understood({words + 1, words + count});
  if (line_words.empty()) {
    std::cerr << app.help();
    return kUsage;
  }
  if (const auto unknown = check_command(app, line_words.front())) return wrong_usage(*unknown);
  try {
    std::reverse(line_words.begin(), line_words.end());  // as the library wants them
    app.parse(std::move(line_words));
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? kDone : kUsage;
  }
  listen.put(serve_reading);
  listen.put(doctor_reading);
  if (*job) return job_main(folder, parent, free_percent);
  if (const auto wrong = check_words(*app.get_subcommands().front())) return wrong_usage(*wrong);
  if (*decode) return decode_command(tile);
  if (*manual) return say(man_page(app));
  if (*completion) {
    const auto script = completions(app, shell);
    return script ? say(*script) : wrong_usage(script.problem());
  }
  if (*check) return check_command(check_line);
  if (*adopt) return adopt_command(data);
  if (*vacuum) return vacuum_command(data, orphans);
  if (*backup) return backup_command(data, backup_place);
  if (*restore) return restore_command(backup_place, data.empty() ? ServeSettings().data : data);
  if (*token) return token_command(token_words);
  if (*doctor) {
    return with_settings(serve_table, doctor_reading, [&](const Settings& settings) { return doctor::doctor_command(settings, doctor_output); });
  }
  if (*simplify) return simplify_command(simplify_line);
  if (*export_file) return export_command(export_line);
  if (*info) {
    const Show show = as_json ? Show::json : Show::table;
    if (path_kind(subject) != PathKind::raster) return info_command(subject, show, {});
    return with_settings(build_options(), info_reading, [&](const Settings& settings) { return info_command(subject, show, settings); });
  }

  if (const auto code = work_words.run()) return *code;
  if (const auto code = client_words.run(own_path())) return *code;
  if (*work_words.plan()) {
    return with_settings(build_options(), plan_reading, [&](const Settings& settings) { return work_words.run_plan(settings); });
  }
  if (*build) {
    return with_settings(build_options(), build_reading, [&](const Settings& settings) {
      line.other = overwrite ? pipeline::Existing::replace : pipeline::Existing::refuse;
      line.words = quiet ? Words::none : Words::all;
      auto chosen = formats_of(formats);
      if (!chosen) return wrong_usage(chosen.problem());
      line.formats = std::move(*chosen);
      line.only_format = formats;
      const auto light = normals_of(normals);
      if (!light) return wrong_usage(light.problem());
      line.normals = *light;
      if (!normals.empty() && line.output.ends_with(".sqlite"))
        return wrong_usage({"usage", "--normals is for a folder: a file of a dataset gives any", "-o FOLDER", "--normals"});
      if (!formats.empty() && line.output.ends_with(".sqlite"))
        return wrong_usage({"usage", "--formats is for a folder or an archive: a file of a dataset gives any", "-o FOLDER or -o FILE.pmtiles", "--formats"});
      if (!line.output.empty() || settings.dry_run) return build_command(settings, line);
      return wrong_usage({"usage", "build needs to know where to write", "-o FOLDER, -o FILE.sqlite, or a name that export writes, such as -o FILE.pmtiles", "--output"});
    });
  }
  return with_settings(serve_table, serve_reading, [](const Settings& settings) { return serve_command(settings, own_path()); });
}
