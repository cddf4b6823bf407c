#include "server/cli/work_line.h"

#include "server/options/option_values.h"
#include "server/options/option_words.h"

namespace cordillera::server {

std::vector<OptionSpec> work_options() {
  std::vector<OptionSpec> options = build_options();
  std::erase_if(options, [](const OptionSpec& option) {
    return option.name != "device" && option.name != "threads" && option.name != "memory";
  });
  for (OptionSpec& option : options) {
    if (option.name != "device") continue;
    option.help = "what computes; cuda:all: every GPU here, a worker each";
    option.accepted = "auto, cpu, cuda, cuda:N or cuda:all";
    option.apply = [](std::string_view text, Settings& settings) {
      if (text != kEveryGpu) return read_device(text, settings.build.mutable_device());
      settings.build.set_device(kEveryGpu);
      return Complaint();
    };
  }
  return options;
}

void WorkWords::add_to(CLI::App& app) {
  plan_ = app.add_subcommand("plan", "cut the build of many rasters into tasks that other machines can do");
  plan_
      ->add_option("sources", plan_line_.sources,
                   "rasters, folders, lists, tile indices, STAC items; the one that wins where they overlap first")
      ->expected(1, -1);
  plan_->add_option("-o,--output", plan_line_.folder, "folder of the plan and of what the tasks leave: a folder, or /vsis3/…")
      ->type_name("FOLDER");
  plan_
      ->add_option(
          "--block", plan_line_.block,
          "most samples along the side of a block; smaller ones make changes cheaper and coarse levels larger [512 to 4096]")
      ->type_name("N");
  add_value_flag(*plan_, "--skip-bad", plan_line_.bad, BadSource::skip, "leave out rasters that cannot be used, and say so");
  add_value_flag(*plan_, "-q,--quiet", plan_line_.words, Verbosity::none, "say nothing but problems");

  tasks_ = app.add_subcommand("tasks", "say how many tasks a plan has and how many are done");
  tasks_->add_option("plan", tasks_folder_, "a folder that plan wrote");
  add_value_flag(*tasks_, "--json", tasks_show_, Show::json, "for programs");

  work_ = app.add_subcommand("work", "do tasks of a plan; 75 as exit code says that trying again may help");
  work_->add_option("plan", work_line_.folder, "a folder that plan wrote");
  const auto option = [this](const char* name, std::string& value, const char* type, const char* help) {
    work_->add_option(name, value, help)->type_name(type);
  };
  option("--stage", work_line_.stage, "N", "which stage; without it all of them, one after the other");
  option("--task", work_line_.task, "K", "one task of the stage");
  option("--part", work_line_.part, "K/N",
         "the K-th of N parts of the stage, of about equal cost; K from 0; array/N: K is the number that a scheduler gives to a "
         "task of an array");
  add_value_flag(*work_, "-q,--quiet", work_line_.words, Verbosity::none, "say nothing but problems");

  publish_ = app.add_subcommand("publish", "check the tiles that the tasks of a plan left, and make them a dataset in one step");
  publish_->add_option("plan", publish_line_.folder, "a folder that plan wrote");
  publish_->add_option("-o,--output", publish_line_.output,
                       "folder to write; a file that export writes, such as *.pmtiles; or *.sqlite, also in object storage: "
                       "/vsis3/BUCKET/NAME.sqlite");
  publish_->add_option("--formats", formats_, "what the folder holds [" + face_names() + "; more than one separated by commas]")
      ->type_name("NAMES");
  for (const LookOption& look : look_options())
    publish_->add_option(look.name, publish_line_.look.*look.value, look.help)->type_name(look.type);
  add_value_flag(*publish_, "--overwrite,--force", publish_line_.other, pipeline::Existing::replace, "replace what is there");
  publish_->add_flag("--prune", publish_line_.prune, "then remove results of earlier plans from the plan's folder");
  add_value_flag(*publish_, "-q,--quiet", publish_line_.words, Verbosity::none, "say nothing but problems");
}

std::optional<int> WorkWords::run() {
  if (*tasks_) return tasks_command(tasks_folder_, tasks_show_);
  if (!*publish_) return std::nullopt;
  auto chosen = formats_of(formats_);
  if (!chosen) return wrong_usage(chosen.problem());
  publish_line_.formats = std::move(*chosen);
  publish_line_.only_format = formats_;
  return publish_command(publish_line_);
}

}  // namespace cordillera::server
