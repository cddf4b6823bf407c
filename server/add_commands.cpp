// A command a function: its words, and what it does with them. Every option of `build` and `serve` comes from the one table in
// options.h.
#include <filesystem>
#include <iostream>
#include <memory>

#include "pipeline/exports/mesh/mesh_output.h"
#include "server/cli/export_command.h"
#include "server/cli/path_kind.h"
#include "server/cli/simplify_command.h"
#include "server/cli/work_line.h"
#include "server/client/client_line.h"
#include "server/command_line.h"
#include "server/doctor/doctor.h"
#include "server/jobs/child.h"
#include "server/options/mesh_options.h"
#include "server/options/option_words.h"
#include "server/options/shell_words.h"
#include "server/options/spoken_words.h"

namespace cordillera::server {
namespace {

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

/// --host and --port, the halves of --listen. The command line's alone: an orchestrator sets CORDILLERA_PORT for reasons of its
/// own, to tcp://10.0.0.1:8080.
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

void add_quiet(CLI::App& command, Verbosity& words) {
  add_value_flag(command, "-q,--quiet", words, Verbosity::none, "say nothing but problems");
}

int say(const std::string& text) {
  std::cout << text;
  return kDone;
}

/// Runs a command with what its options say, or tells what is wrong with them.
int with_settings(const std::vector<OptionSpec>& table, const Reading& reading, const std::function<int(const Settings&)>& run) {
  for (const std::string& sentence : unread_variables()) std::cerr << "cordillera: warning: " << sentence << "\n";
  const auto settings = settings_from(table, reading);
  if (!settings) return wrong_usage(settings.problem());
  return run(*settings);
}

std::string own_path() {
  std::error_code error;
  return std::filesystem::read_symlink("/proc/self/exe", error).string();
}

/// What a file of a whole dataset does not take.
std::optional<proto::Problem> check_words_of_file(const std::string& output, const std::string& formats, const LookWords& look) {
  if (!output.ends_with(".sqlite")) return std::nullopt;
  if (const auto shown = check_look_of_store(look); !shown) return shown.problem();
  if (!formats.empty())
    return proto::Problem{"usage", "--formats is for a folder or an archive: a file of a dataset gives any",
                          "-o FOLDER or -o FILE.pmtiles", "--formats"};
  return std::nullopt;
}

void add_serve(CommandLine& commands) {
  struct Line {
    Reading reading;
    ListenWords listen;
  };
  const auto line = std::make_shared<Line>();
  auto* serve = commands.add("serve", "run the HTTP service; build options are the defaults of its requests", [line] {
    line->listen.put(line->reading);
    return with_settings(all_options(), line->reading,
                         [](const Settings& settings) { return serve_command(settings, own_path()); });
  });
  add_options(*serve, all_options(), line->reading);
  line->listen.add_to(*serve);
}

/// Options of build that are none of a dataset.
struct BuildWords {
  Reading reading;
  BuildLine line;
  std::string formats;

  int run(const Settings& settings) {
    auto chosen = formats_of(formats);
    if (!chosen) return wrong_usage(chosen.problem());
    line.formats = std::move(*chosen);
    line.only_format = formats;
    if (const auto wrong = check_words_of_file(line.output, formats, line.look)) return wrong_usage(*wrong);
    const bool folder = !line.output.empty() && !line.output.ends_with(".sqlite") && !is_export_name(line.output);
    if (const auto shown = check_look(line.look, line.formats); folder && !shown) return wrong_usage(shown.problem());
    if (!line.output.empty() || settings.dry_run) return build_command(settings, line);
    std::error_code error;
    const std::string& last = line.rasters.back();
    if (line.rasters.size() > 1 && last.find("://") == last.npos && !last.starts_with("/vsi") &&
        !std::filesystem::exists(last, error))
      return wrong_usage({"usage", "build needs to know where to write, and there is no " + last,
                          "-o " + last + ", if that is to be written", "--output"});
    return wrong_usage({"usage", "build needs to know where to write",
                        "-o FOLDER, -o FILE.sqlite, or a name that export writes, such as -o FILE.pmtiles", "--output"});
  }
};

void add_build(CommandLine& commands) {
  const auto words = std::make_shared<BuildWords>();
  BuildLine& line = words->line;
  auto* build = commands.add("build", "make a static folder of tiles that any web server can host", [words] {
    return with_settings(build_options(), words->reading, [&](const Settings& settings) { return words->run(settings); });
  });
  build
      ->add_option("raster", line.rasters,
                   "the elevation model: GeoTIFF, .hgt, NetCDF, .img, DTED, XYZ or another, also in a .zip or .gz; or several, "
                   "folders and lists of them, "
                   "the one that wins where they overlap first")
      ->expected(1, -1);
  constexpr const char* kOutput = "Output";  // a group of the table's, too
  build
      ->add_option("-o,--output", line.output,
                   "folder to write; or a file, by its name: .sqlite, .pmtiles, .mbtiles, .3tz, or a mesh (" +
                       pipeline::exports::mesh_endings_text(", ") + ")")
      ->group(kOutput);
  build
      ->add_flag_callback(
          "--overwrite,--force", [&line] { line.other = pipeline::Existing::replace; },
          "replace another build that is there; without it, only an unfinished one of the same "
          "raster and options goes on")
      ->group(kOutput);
  add_value_flag(*build, "--skip-bad", line.bad, BadSource::skip,
                 "of several rasters leave out those that cannot be used, and say so");
  build
      ->add_option("--formats", words->formats, "what the folder holds [" + face_names() + "; more than one separated by commas]")
      ->type_name("NAMES")
      ->group(kOutput);
  for (const LookOption& option : look_options())
    build->add_option(option.name, line.look.*option.value, option.help)->type_name(option.type)->group(kOutput);
  add_quiet(*build, line.words);
  add_options(*build, build_options(), words->reading);
}

void add_info(CommandLine& commands) {
  struct Line {
    Reading reading;
    std::string subject;
    Show show = Show::table;
    BadSource bad = BadSource::refuse;
  };
  const auto line = std::make_shared<Line>();
  auto* info = commands.add("info",
                            "print the manifest of a folder or dataset that was built, or what a raster is and what a build with "
                            "these options would make",
                            [line] {
                              const PathKind kind = path_kind(line->subject);
                              if (kind != PathKind::raster && kind != PathKind::folder)
                                return info_command(line->subject, line->show, {});
                              return with_settings(build_options(), line->reading, [&](const Settings& settings) {
                                return info_command(line->subject, line->show, settings, line->bad);
                              });
                            });
  info->add_option("path", line->subject, "a folder that build wrote, a dataset.sqlite, a raster, or a folder of rasters");
  add_value_flag(*info, "--json", line->show, Show::json, "the manifest itself; of a raster, the dry run");
  add_value_flag(*info, "--skip-bad", line->bad, BadSource::skip,
                 "of a folder's rasters leave out those that cannot be used, as build does");
  add_options(*info, build_options(), line->reading);
}

void add_decode(CommandLine& commands) {
  const auto tile = std::make_shared<std::string>();
  auto* decode =
      commands.add("decode", "check a .drc or .glb tile: decode it and count", [tile] { return decode_command(*tile); });
  decode->add_option("tile", *tile, "a tile file");
}

void add_simplify(CommandLine& commands) {
  const auto held = std::make_shared<SimplifyLine>();
  SimplifyLine& line = *held;
  auto* simplify = commands.add("simplify", "make a height-field mesh smaller: x and y in the plan, z up",
                                [held] { return simplify_command(*held); });
  simplify->add_option("mesh", line.input, "PLY, OFF or OBJ");
  simplify->add_option("-o,--output", line.output, "what to write: .ply, .off or .obj")->type_name("FILE");
  add_rows(*simplify, simplify_options(), line.given);
  add_value_flag(*simplify, "--json", line.show, Show::json, "the report as JSON");
}

void add_export(CommandLine& commands) {
  const auto held = std::make_shared<ExportLine>();
  ExportLine& line = *held;
  auto* command = commands.add("export", "write a dataset as one file, or a part of it as one mesh",
                               [held] { return export_command(*held); });
  command->add_option("source", line.source, "a dataset.sqlite, or a dataset's folder in a server's data");
  command
      ->add_option("-o,--output", line.output,
                   "what to write: .pmtiles, .mbtiles, .3tz, or a mesh: " + pipeline::exports::mesh_endings_text(", "))
      ->type_name("FILE");
  command->add_option("--format", line.format, "which tiles an archive holds [" + archived_face_names() + "]")->type_name("NAME");
  for (const LookOption& option : look_options())
    command->add_option(option.name, line.look.*option.value, option.help)->type_name(option.type);
  add_rows(*command, mesh_options(), line.mesh);
  command->add_option("--threads", line.threads, "threads that make an archive's tiles; 0: one for each usable core [0 to 1024]")
      ->type_name("N");
  command->add_option("--max-triangles", line.most_triangles, "most triangles of a mesh [1 to 100000000; default 10000000]")
      ->type_name("N");
  add_value_flag(*command, "--overwrite,--force", line.other, pipeline::Existing::replace, "replace a file that is there");
  add_quiet(*command, line.words);
}

void add_work(CommandLine& commands) {
  struct Line {
    WorkWords words;
    Reading plan, work;
  };
  const auto line = std::make_shared<Line>();
  line->words.add_to(commands.app());
  add_options(*line->words.plan(), build_options(), line->plan);
  const std::vector<OptionSpec> of_work = work_options();
  add_table(*line->words.work(), of_work, line->work.given);
  for (CLI::App* command : line->words.commands()) {
    commands.know(command, [line, of_work] {
      if (const auto code = line->words.run()) return *code;
      if (*line->words.work())
        return with_settings(of_work, line->work, [&](const Settings& settings) { return line->words.run_work(settings); });
      return with_settings(build_options(), line->plan, [&](const Settings& settings) { return line->words.run_plan(settings); });
    });
  }
}

void add_client(CommandLine& commands) {
  const auto words = std::make_shared<client::ClientWords>();
  words->add_to(commands.app());
  for (CLI::App* command : words->commands()) commands.know(command, [words] { return words->run(own_path()).value_or(kUsage); });
}

void add_check(CommandLine& commands) {
  const auto line = std::make_shared<CheckLine>();
  auto* check =
      commands.add("check", "verify a dataset: every checksum, record, border and bound; the exit code says what came out",
                   [line] { return check_command(*line); });
  check->add_option("path", line->path,
                    "a dataset.sqlite, a dataset's folder, a folder that build wrote, or a server's data folder");
  check
      ->add_option("--source", line->sources,
                   "the raster it was built from: stated errors are measured against it; of several a --source each, in their "
                   "order, or their list")
      ->type_name("RASTER")
      ->allow_extra_args(false);  // what follows is the dataset
  add_value_flag(*check, "--json", line->show, Show::json, "the report as JSON");
  add_quiet(*check, line->words);
}

/// What is done to a server's data folder.
void add_keeping(CommandLine& commands) {
  struct Line {
    std::string data, backup;
    Orphans orphans = Orphans::keep;
    Verbosity words = Verbosity::all;
  };
  const auto line = std::make_shared<Line>();
  auto* vacuum = commands.add("vacuum", "remove from a stopped server's data folder what nothing names, and give free pages back",
                              [line] { return vacuum_command(line->data, line->orphans, line->words); });
  vacuum->add_option("data", line->data, "the data folder");
  add_value_flag(*vacuum, "--orphans", line->orphans, Orphans::remove,
                 "also remove folders that were set aside because no dataset could be made of them");
  auto* adopt = commands.add("adopt", "make a new registry for a stopped server's data folder whose registry is lost",
                             [line] { return adopt_command(line->data); });
  adopt->add_option("data", line->data, "the data folder");
  auto* backup = commands.add("backup", "copy a server's data folder while the server runs",
                              [line] { return backup_command(line->data, line->backup, line->words); });
  backup->add_option("data", line->data, "the data folder");
  backup->add_option("-o,--output", line->backup, "a folder that does not exist yet")->type_name("FOLDER");
  auto* restore = commands.add("restore", "make a data folder from a backup", [line] {
    return restore_command(line->backup, line->data.empty() ? ServeSettings().data : line->data, line->words);
  });
  restore->add_option("backup", line->backup, "a folder that backup wrote");
  restore->add_option("--data", line->data, "the data folder to make [cordillera-data]")->type_name("FOLDER");
  for (CLI::App* command : {vacuum, backup, restore}) add_quiet(*command, line->words);
}

void add_token(CommandLine& commands) {
  const auto held = std::make_shared<TokenWords>();
  TokenWords& words = *held;
  auto* command = commands.add("token", "make a token for who may write to a service", [held] { return token_command(*held); });
  command->add_option("action", words.action, "new");
  command->add_option("--name", words.name, "who gets it; stands in logs")->type_name("NAME");
  command->add_option("--role", words.role, "what it allows [read, write, admin]")->type_name("ROLE");
  command->add_option("--file", words.file, "add its line to this file, that of serve --tokens")->type_name("FILE");
}

void add_doctor(CommandLine& commands) {
  struct Line {
    Reading reading;
    ListenWords listen;
    doctor::Output output = doctor::Output::lines;
  };
  const auto line = std::make_shared<Line>();
  auto* doctor = commands.add("doctor", "look whether this machine is fit to serve; takes the options of serve", [line] {
    line->listen.put(line->reading);
    return with_settings(all_options(), line->reading,
                         [&](const Settings& settings) { return doctor::doctor_command(settings, line->output); });
  });
  add_options(*doctor, all_options(), line->reading);
  line->listen.add_to(*doctor);
  add_value_flag(*doctor, "--json", line->output, doctor::Output::json, "the findings as JSON");
}

void add_shell(CommandLine& commands) {
  const auto shell = std::make_shared<std::string>();
  CLI::App& app = commands.app();
  auto* completion =
      commands.add("completion", "print completions for a shell: source <(cordillera completion bash)", [shell, &app] {
        const auto script = completions(app, *shell);
        return script ? say(*script) : wrong_usage(script.problem());
      });
  completion->add_option("shell", *shell, "bash, zsh or fish");
  commands.add("man", "print the manual page: cordillera man | man -l -", [&app] { return say(man_page(app)); });
}

/// What the service runs to open a raster. Nobody types it.
void add_job(CommandLine& commands) {
  struct Line {
    std::string folder;
    int parent = 0;
    std::uint32_t free_percent = 0;
  };
  const auto line = std::make_shared<Line>();
  auto* job = commands.add("job", "", [line] { return job_main(line->folder, line->parent, line->free_percent); });
  job->group("");
  job->add_option("folder", line->folder);
  job->add_option("--parent", line->parent);
  job->add_option("--free-percent", line->free_percent);
}

}  // namespace

void add_commands(CommandLine& commands) {
  for (const auto add : {add_serve, add_build, add_info, add_decode, add_simplify, add_export, add_work, add_client, add_check,
                         add_keeping, add_token, add_doctor, add_shell, add_job}) {
    add(commands);
  }
}

}  // namespace cordillera::server
