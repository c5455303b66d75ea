#include "bridge/program/completion.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "bridge/cli/shell_word.hpp"
#include "bridge/program/command_model.hpp"

namespace trestle::program {
namespace {

/// The first line of what is said of a command or an option.
std::string said_of(const std::string& description) {
  return description.substr(0, description.find('\n'));
}

/// What bash and zsh have in common: which command the words before the cursor name. An option's value is no
/// command. `name` is the variable that holds it, `word` that word.
std::string walk(const CLI::App& app, const std::string& word) {
  std::string cases;
  for (const CLI::App* command : all_commands(app)) {
    std::vector<std::string> with_value;
    for (const CLI::Option* option : options_of(*command)) {
      for (const std::string& name : names_of(*option)) {
        if (option->get_type_size() != 0) {
          with_value.push_back(cli::shell_quoted(full_name(*command) + " " + name));
        }
      }
    }
    if (!with_value.empty()) {
      cases += fmt::format("      {}) ((++i)) ;;\n", fmt::join(with_value, " | "));
    }
    for (const CLI::App* inner : commands_of(*command)) {
      cases += fmt::format("      {0}) command={0} ;;\n", cli::shell_quoted(full_name(*inner)));
    }
  }
  return fmt::format("    case \"$command {}\" in\n{}    esac\n", word, cases);
}

/// The values of options: a case for each that has words, and one for all that are files, and for all others.
/// @param words, files  what the shell does then; {} is the words.
std::string values(const CLI::App& app, fmt::string_view words, const char* files) {
  std::string cases;
  std::vector<std::string> of_files;
  std::vector<std::string> others;
  for (const CLI::App* command : all_commands(app)) {
    for (const CLI::Option* option : options_of(*command)) {
      if (option->get_type_size() == 0) {
        continue;
      }
      const std::vector<std::string> choices = value_words(*option);
      for (const std::string& name : names_of(*option)) {
        const std::string pattern = cli::shell_quoted(full_name(*command) + " " + name);
        if (!choices.empty()) {
          cases += fmt::format("    {}) {}; return ;;\n", pattern,
                               fmt::format(fmt::runtime(words), fmt::join(choices, " ")));
        } else {
          (is_file(*option) ? of_files : others).push_back(pattern);
        }
      }
    }
  }
  if (!of_files.empty()) {
    cases += fmt::format("    {}) {}; return ;;\n", fmt::join(of_files, " | "), files);
  }
  if (!others.empty()) {
    cases += fmt::format("    {}) return ;;\n", fmt::join(others, " | "));
  }
  return cases;
}

}  // namespace

std::string bash_completion(const CLI::App& app) {
  std::string known;
  for (const CLI::App* command : all_commands(app)) {
    std::vector<std::string> commands;
    for (const CLI::App* inner : commands_of(*command)) {
      commands.push_back(inner->get_name());
    }
    std::vector<std::string> options;
    for (const CLI::Option* option : options_of(*command)) {
      const std::vector<std::string> names = names_of(*option);
      options.insert(options.end(), names.begin(), names.end());
    }
    known += fmt::format("    {}) commands='{}' options='{}' ;;\n", cli::shell_quoted(full_name(*command)),
                         fmt::join(commands, " "), fmt::join(options, " "));
  }
  return fmt::format(
      R"(# Completion of {0} for bash; `{0} completion bash` wrote it.
_{0}() {{
  local current=${{COMP_WORDS[COMP_CWORD]}} before=${{COMP_WORDS[COMP_CWORD - 1]}} command={0} commands='' options='' i
  for ((i = 1; i < COMP_CWORD; ++i)); do
{1}  done
  COMPREPLY=()
  if [[ $current == '=' ]]; then  # --option=value is three words to bash
    current=''
  elif [[ $before == '=' && COMP_CWORD -gt 2 ]]; then
    before=${{COMP_WORDS[COMP_CWORD - 2]}}
  fi
  case "$command $before" in
{2}  esac
  case "$command" in
{3}  esac
  if [[ $current == -* ]]; then
    mapfile -t COMPREPLY < <(compgen -W "$options" -- "$current")
  elif [[ -n $commands ]]; then
    mapfile -t COMPREPLY < <(compgen -W "$commands" -- "$current")
  else
    compopt -o filenames 2>/dev/null
    mapfile -t COMPREPLY < <(compgen -f -- "$current")
  fi
}}
complete -F _{0} {0}
)",
      app.get_name(), walk(app, "${COMP_WORDS[i]}"),
      values(app, "mapfile -t COMPREPLY < <(compgen -W '{}' -- \"$current\")",
             "compopt -o filenames 2>/dev/null; mapfile -t COMPREPLY < <(compgen -f -- \"$current\")"),
      known);
}

std::string zsh_completion(const CLI::App& app) {
  // To _describe, ':' ends the word.
  const auto described = [](std::string word, const std::string& description) {
    for (std::size_t at = 0; (at = word.find(':', at)) != std::string::npos; at += 2) {
      word.insert(at, "\\");
    }
    return cli::shell_quoted(word + ":" + said_of(description));
  };
  std::string known;
  for (const CLI::App* command : all_commands(app)) {
    known += fmt::format("    {})\n", cli::shell_quoted(full_name(*command)));
    for (const CLI::App* inner : commands_of(*command)) {
      known += fmt::format("      commands+=({})\n", described(inner->get_name(), inner->get_description()));
    }
    for (const CLI::Option* option : options_of(*command)) {
      for (const std::string& name : names_of(*option)) {
        known += fmt::format("      options+=({})\n", described(name, option->get_description()));
      }
    }
    known += "      ;;\n";
  }
  return fmt::format(R"(#compdef {0}
# Completion of {0} for zsh; `{0} completion zsh` wrote it.
_{0}() {{
  local command={0} i
  local -a commands options
  for ((i = 2; i < CURRENT; ++i)); do
{1}  done
  case "$command ${{words[CURRENT - 1]}}" in
{2}  esac
  case "$command" in
{3}  esac
  if [[ ${{words[CURRENT]}} == -* ]]; then
    _describe -o option options
  elif (( ${{#commands}} )); then
    _describe command commands
  else
    _files
  fi
}}
if [[ ${{funcstack[1]}} == _{0} ]]; then _{0} "$@"; else compdef _{0} {0}; fi
)",
                     app.get_name(), walk(app, "${words[i]}"),
                     values(app, "commands=({}); _describe value commands", "_files"), known);
}

std::string fish_completion(const CLI::App& app) {
  const std::string& program = app.get_name();
  std::string script = fmt::format(R"(# Completion of {0} for fish; `{0} completion fish` wrote it.
function __{0}_at
    set -l words (commandline -opc)
    set -e words[1]
    set -l command {0}
    set -l skip 0
    for word in $words
        if test $skip = 1
            set skip 0
            continue
        end
        switch "$command $word"
)",
                                   program);
  for (const CLI::App* command : all_commands(app)) {
    for (const CLI::Option* option : options_of(*command)) {
      for (const std::string& name : names_of(*option)) {
        if (option->get_type_size() != 0) {
          script += fmt::format("            case {}\n                set skip 1\n",
                                cli::shell_quoted(full_name(*command) + " " + name));
        }
      }
    }
    for (const CLI::App* inner : commands_of(*command)) {
      script += fmt::format("            case {0}\n                set command {0}\n",
                            cli::shell_quoted(full_name(*inner)));
    }
  }
  script += fmt::format(R"(        end
    end
    test "$command" = "$argv[1]"
end
)");
  for (const CLI::App* command : all_commands(app)) {
    const std::string here =
        fmt::format("complete -c {} -n {}", program,
                    cli::shell_quoted("__" + program + "_at \"" + full_name(*command) + "\""));
    const std::vector<const CLI::App*> commands = commands_of(*command);
    for (const CLI::App* inner : commands) {
      script += fmt::format("{} -f -a {} -d {}\n", here, inner->get_name(),
                            cli::shell_quoted(said_of(inner->get_description())));
    }
    if (!commands.empty()) {
      script += here + " -f\n";
    }
    for (const CLI::Option* option : options_of(*command)) {
      script += here;
      for (const std::string& name : option->get_lnames()) {
        script += " -l " + name;
      }
      for (const std::string& name : option->get_snames()) {
        script += " -s " + name;
      }
      const std::vector<std::string> choices = value_words(*option);
      if (!choices.empty()) {
        script += fmt::format(" -x -a {}", cli::shell_quoted(fmt::format("{}", fmt::join(choices, " "))));
      } else if (option->get_type_size() != 0) {
        script += is_file(*option) ? " -r -F" : " -x";
      }
      script += fmt::format(" -d {}\n", cli::shell_quoted(said_of(option->get_description())));
    }
  }
  return script;
}

}  // namespace trestle::program
