#include "server/options/shell_words.h"

#include <vector>

namespace cordillera::server {
namespace {

using Commands = std::vector<const CLI::App*>;

/// Those that people type.
Commands commands_of(const CLI::App& app) {
  Commands commands;
  for (const CLI::App* command : app.get_subcommands(nullptr)) {
    if (!command->get_group().empty()) commands.push_back(command);
  }
  return commands;
}

/// "--error", "-o": every spelling, the long ones first.
std::vector<std::string> spellings(const CLI::Option& option) {
  std::vector<std::string> names;
  for (const std::string& name : option.get_lnames()) names.push_back("--" + name);
  for (const std::string& name : option.get_snames()) names.push_back("-" + name);
  return names;
}

bool takes_value(const CLI::Option& option) { return option.get_expected_min() > 0 && option.get_type_size() != 0; }

std::string replaced(std::string text, const std::string& from, const std::string& to) {
  for (std::size_t at = text.find(from); at != text.npos; at = text.find(from, at + to.size())) text.replace(at, from.size(), to);
  return text;
}

/// Within single quotes of bash and zsh.
std::string quoted(const std::string& text) { return replaced(text, "'", "'\\''"); }

std::string bash(const Commands& commands) {
  std::string names, cases;
  for (const CLI::App* command : commands) {
    names += (names.empty() ? "" : " ") + command->get_name();
    std::string words;
    for (const CLI::Option* option : command->get_options()) {
      for (const std::string& name : spellings(*option)) words += " " + name;
    }
    cases += "    " + command->get_name() + ") options='" + words.substr(words.empty() ? 0 : 1) + "' ;;\n";
  }
  return "# Completions of cordillera for bash.\n_cordillera() {\n  local word=${COMP_WORDS[COMP_CWORD]} options=\n  if [[ "
         "$COMP_CWORD -eq 1 ]]; then\n    mapfile -t COMPREPLY < <(compgen -W '" +
         names + " help version' -- \"$word\")\n    return\n  fi\n  case ${COMP_WORDS[1]} in\n" + cases +
         "  esac\n  if [[ $word == -* ]]; then\n    mapfile -t COMPREPLY < <(compgen -W \"$options\" -- \"$word\")\n  else\n    "
         "mapfile -t COMPREPLY < <(compgen -f -- \"$word\")\n  fi\n}\n"
         "complete -o filenames -F _cordillera cordillera\n";
}

std::string zsh(const Commands& commands) {
  const auto described = [](const std::string& text) {
    return quoted(replaced(replaced(replaced(replaced(text, "\\", "\\\\"), "[", "\\["), "]", "\\]"), ":", "\\:"));
  };
  std::string names, cases;
  for (const CLI::App* command : commands) {
    names += " '" + command->get_name() + ":" + described(command->get_description()) + "'";
    cases += "    " + command->get_name() + ") _arguments '*:file:_files'";
    for (const CLI::Option* option : command->get_options()) {
      for (const std::string& name : spellings(*option))
        cases += " \\\n      '" + name + "[" + described(option->get_description()) + "]" +
                 (takes_value(*option) ? ": :_files'" : "'");
    }
    cases += " ;;\n";
  }
  return "#compdef cordillera\n_cordillera() {\n  if (( CURRENT == 2 )); then\n    local -a commands=(" + names +
         ")\n    _describe command commands\n    return\n  fi\n  shift words\n  (( CURRENT-- ))\n  case $words[1] in\n" + cases +
         "  esac\n}\ncompdef _cordillera cordillera\n";
}

std::string fish(const Commands& commands) {
  const auto text = [](const std::string& plain) { return "'" + replaced(replaced(plain, "\\", "\\\\"), "'", "\\'") + "'"; };
  std::string out = "# Completions of cordillera for fish.\n";
  for (const CLI::App* command : commands) {
    out += "complete -c cordillera -n __fish_use_subcommand -f -a " + command->get_name() + " -d " +
           text(command->get_description()) + "\n";
    for (const CLI::Option* option : command->get_options()) {
      const std::vector<std::string> names = spellings(*option);
      if (names.empty()) continue;
      out += "complete -c cordillera -n '__fish_seen_subcommand_from " + command->get_name() + "'";
      for (const std::string& name : names) out += name.starts_with("--") ? " -l " + name.substr(2) : " -s " + name.substr(1);
      out += (takes_value(*option) ? " -r -d " : " -d ") + text(option->get_description()) + "\n";
    }
  }
  return out;
}

std::string troff(const std::string& text) {
  std::string out = replaced(replaced(text, "\\", "\\e"), "-", "\\-");
  return out.starts_with('.') || out.starts_with('\'') ? "\\&" + out : out;
}

std::string option_entry(const CLI::Option& option) {
  std::string names;
  for (const std::string& name : spellings(option)) names += (names.empty() ? "" : ", ") + name;
  const std::string value = takes_value(option) ? option.get_type_name() : "";
  if (names.empty()) names = option.get_name(true);
  return ".TP\n.B " + troff(names) + (value.empty() ? "" : " " + troff(value)) + "\n" + troff(option.get_description()) + "\n";
}

}  // namespace

proto::Result<std::string> completions(const CLI::App& app, const std::string& shell) {
  const Commands commands = commands_of(app);
  if (shell == "bash") return bash(commands);
  if (shell == "zsh") return zsh(commands);
  if (shell == "fish") return fish(commands);
  return proto::Problem{"usage", "no completions are made for '" + shell + "'", "bash, zsh or fish", "shell"};
}

std::string man_page(const CLI::App& app) {
  const std::string name = app.get_name();
  std::string out = ".TH CORDILLERA 1 \"\" \"cordillera " CORDILLERA_VERSION "\"\n.SH NAME\n" + name + " \\- " +
                    troff(app.get_description()) + "\n.SH SYNOPSIS\n.B " + name +
                    "\n.I COMMAND\n[\n.I OPTION\n]...\n.SH COMMANDS\n";
  for (const CLI::App* command : commands_of(app)) {
    out += ".SS " + name + " " + command->get_name() + "\n" + troff(command->get_description()) + "\n";
    for (const CLI::Option* option : command->get_options()) out += option_entry(*option);
    if (!command->get_footer().empty()) out += ".PP\n" + troff(command->get_footer()) + "\n";
  }
  return out + ".SH EXIT STATUS\n0 done, 1 failed or bad input, 2 wrong usage, 75 where trying again may help.\n";
}

}  // namespace cordillera::server
