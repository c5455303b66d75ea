#include "bridge/carry/commands/explain.hpp"

#include <fmt/format.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cstdio>
#include <iterator>

#include "bridge/carry/config/load_interfaces.hpp"
#include "bridge/carry/config/ros_environment.hpp"
#include "bridge/cli/exit_status.hpp"
#include "bridge/documents/document.hpp"
#include "bridge/messages/convert/check_type.hpp"
#include "bridge/messages/map/map_compiler.hpp"

namespace trestle::carry {
namespace {

std::string_view line_of(std::string_view text, int number) {
  for (int line = 1; line < number; ++line) {
    const std::size_t end = text.find('\n');
    if (end == std::string_view::npos) {
      return {};
    }
    text.remove_prefix(end + 1);
  }
  const std::string_view line = text.substr(0, text.find('\n'));
  return line.ends_with('\r') ? line.substr(0, line.size() - 1) : line;
}

/// The line with a caret below the column. Left out where it would not be readable.
std::string excerpt(std::string_view text, documents::Mark mark, const cli::Colours& colours) {
  constexpr std::size_t shown_max = 160;
  const std::string_view line = line_of(text, mark.line);
  const auto column = static_cast<std::size_t>(mark.column - 1);
  const auto unprintable = [](char c) { return static_cast<unsigned char>(c) < 0x20 && c != '\t'; };
  if (line.size() > shown_max || column > line.size() || std::ranges::any_of(line, unprintable)) {
    return {};
  }
  // Tabs stay tabs so that the caret lands where the terminal puts the character.
  std::string indent{line.substr(0, column)};
  std::ranges::replace_if(
      indent, [](char c) { return c != '\t'; }, ' ');
  return fmt::format("{:5} | {}\n      | {}{}^{}\n", mark.line, line, indent, colours.green, colours.off);
}

/// What is to be said of a mapping of fields, and of the payload's type.
std::vector<messages::MapProblem> check_mapping(const TypeUse& use, const messages::MessageRules& rules,
                                                const messages::TypePlaces& places) {
  const messages::MarkedText& payload = use.mapping->payload;
  if (const std::string fault = messages::check_type(payload.text, places, rules); !fault.empty()) {
    return {{payload.mark, "payload: " + fault}};
  }
  std::vector<messages::MapProblem> problems =
      messages::check_map(use.type, *use.mapping, map_direction(use.direction), places);
  if (const std::string warning = messages::check_lengths(payload.text, places, rules); !warning.empty()) {
    problems.push_back({payload.mark, "payload: " + warning, false});
  }
  return problems;
}

/// On standard error, those of each file with its lines.
void print_problems(const std::vector<documents::Problem>& problems) {
  for (auto begin = problems.begin(); begin != problems.end();) {
    const auto end = std::find_if(begin, problems.end(), [&](const documents::Problem& problem) {
      return problem.file != begin->file;
    });
    // A problem with a place means that the file could be read, and is not large.
    const bool has_place = std::prev(end)->mark.line > 0;
    const std::string text = has_place ? documents::read_text_file(begin->file).value_or("") : "";
    std::fputs(explain({begin, end}, text, cli::colours_for(STDERR_FILENO)).c_str(), stderr);
    begin = end;
  }
}

}  // namespace

std::string explain(const std::vector<documents::Problem>& problems, std::string_view text,
                    const cli::Colours& colours) {
  std::string out;
  constexpr std::ptrdiff_t shown_max = 50;
  std::size_t errors = 0;
  for (auto at = problems.begin(); at != problems.end(); ++at) {
    const documents::Problem& problem = *at;
    const bool is_error = problem.severity == documents::Problem::Severity::error;
    errors += is_error ? 1 : 0;
    if (at - problems.begin() >= shown_max) {
      continue;
    }
    // In the result of to_string() the severity stands between the place and the text.
    const std::string severity = is_error ? "error: " : "warning: ";
    std::string message = to_string(problem);
    message.insert(message.size() - problem.text.size(), colours.off);
    message.insert(
        message.size() - problem.text.size() - severity.size() - std::string_view{colours.off}.size(),
        is_error ? colours.red : colours.yellow);
    out += message + "\n";
    // Several problems of one place share its excerpt.
    const auto next = std::next(at);
    if (problem.mark.line > 0 && (next == problems.end() || next->mark != problem.mark)) {
      out += excerpt(text, problem.mark, colours);
    }
  }
  if (errors > 1) {
    const bool all = std::ssize(problems) <= shown_max;
    out += fmt::format("{} errors in {}{}\n", errors, problems.front().file,
                       all ? "" : ", not all of them shown");
  }
  return out;
}

TypeVerdict verdict_on(const TypeUse& use, const messages::MessageRules& rules,
                       const messages::TypePlaces& places) {
  if (use.access != messages::FieldAccess::none) {
    return {messages::check_field_service(use.type, use.value_type, use.access, places, rules),
            messages::check_lengths(use.value_type, places, rules)};
  }
  if (use.mapping != nullptr) {
    return {.fault = messages::check_type(use.type, places), .map = check_mapping(use, rules, places)};
  }
  return {messages::check_type(use.type, places, rules), messages::check_lengths(use.type, places, rules)};
}

std::optional<int> answer_descriptions(std::vector<std::string>& files, bool saves) {
  const auto others = std::stable_partition(files.begin(), files.end(), is_description);
  const std::vector<std::string> descriptions{files.begin(), others};
  files.erase(files.begin(), others);
  if (descriptions.empty()) {
    return std::nullopt;
  }
  const auto configuration = configuration_for(descriptions);
  if (!configuration) {
    print_problems(configuration.error());
    return cli::exit_usage;
  }
  std::fputs(configuration->c_str(), stdout);
  struct stat output {};
  if (saves && files.empty() && fstat(STDOUT_FILENO, &output) == 0 && S_ISREG(output.st_mode)) {
    fmt::print(
        stderr,
        "{} is an interface description: a configuration that names it, seen from the current folder, was "
        "written to standard output, and no bridge was run\n",
        descriptions.front());
    return cli::exit_ok;
  }
  print_problems({{documents::Problem::Severity::error,
                   descriptions.front(),
                   {},
                   "is an interface description: expected a configuration. One that names it goes to "
                   "standard output: `> bridge.yaml` behind the command saves it"}});
  return cli::exit_usage;
}

std::optional<Loaded> load_or_explain(const std::string& file) {
  if (std::vector files{file}; answer_descriptions(files)) {
    return std::nullopt;
  }
  auto loaded = load_config(file, verdict_on);
  // Problems of the file itself, then those of the lock file that it names.
  print_problems(loaded ? loaded->warnings : loaded.error());
  if (!loaded) {
    return std::nullopt;
  }
  if (const std::string fault = apply_ros_environment(loaded->config.dds, process_environment());
      !fault.empty()) {
    print_problems({{documents::Problem::Severity::error, file, {}, fault}});
    return std::nullopt;
  }
  return std::move(*loaded);
}

}  // namespace trestle::carry
