#include "bridge/program/man_page.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <sstream>

#include "bridge/program/command_model.hpp"

namespace trestle::program {
namespace {

/// Text as roff takes it: '-' and '\'' would become other characters, a leading '.' a request.
std::string roff(const std::string& text) {
  std::string result;
  for (const char c : text) {
    if (c == '\\') {
      result += "\\e";
    } else if (c == '-') {
      result += "\\-";
    } else if (c == '\'') {
      result += "\\(aq";
    } else if (c == '^') {
      result += "\\(ha";
    } else if (c == '~') {
      result += "\\(ti";
    } else if (c == '`') {
      result += "\\(ga";
    } else if (c == '.' && (result.empty() || result.back() == '\n')) {
      result += "\\&.";
    } else {
      result += c;
    }
  }
  return result;
}

std::string page_title(const CLI::App& command) {
  std::string title = full_name(command);
  std::ranges::replace(title, ' ', '-');
  return title;
}

std::string option_entry(const CLI::Option& option) {
  std::vector<std::string> names;
  for (const std::string& name : names_of(option)) {
    names.push_back("\\fB" + roff(name) + "\\fR");
  }
  std::ranges::reverse(names);  // the short ones first, as in the help
  std::string text = fmt::format(".TP\n{}", fmt::join(names, ", "));
  if (const std::string value = value_name(option); !value.empty()) {
    text += " \\fI" + roff(value) + "\\fR";
  }
  const bool several = option.get_expected_max() > 1 && option.get_allow_extra_args();
  text += several ? " ..." : "";
  text += "\n" + roff(option.get_description());
  if (!option.get_default_str().empty()) {
    text += fmt::format(" (default: {})", roff(option.get_default_str()));
  }
  return text + "\n";
}

/// The paragraphs below the options. Lines that stand further in, as examples do, keep their form.
std::string notes(const std::string& footer) {
  if (footer.empty()) {
    return {};
  }
  std::string text;
  bool keeps_form = false;
  bool begins = true;
  const auto keep_form = [&](bool keep) {
    if (keep != keeps_form) {
      text += keep ? ".PP\n.nf\n" : ".fi\n";
      keeps_form = keep;
      begins = false;
    }
  };
  std::istringstream lines{footer};
  bool has_heading = false;
  for (std::string line; std::getline(lines, line);) {
    if (line == "Examples:") {
      keep_form(false);
      text += ".SH EXAMPLES\n";
      has_heading = true;
      begins = true;
      continue;
    }
    if (!has_heading) {
      text += ".SH NOTES\n";
      has_heading = true;
    }
    if (line.empty()) {
      keep_form(false);
      begins = false;
      text += ".PP\n";
      continue;
    }
    keep_form(line.starts_with("  "));
    text += roff(line) + "\n";
  }
  keep_form(false);
  return text;
}

}  // namespace

std::string man_page_name(const CLI::App& command) {
  return page_title(command) + ".1";
}

std::string man_page(const CLI::App& command, const std::string& version) {
  const std::vector<const CLI::App*> commands = commands_of(command);
  const std::vector<const CLI::Option*> arguments = arguments_of(command);
  std::string title = page_title(command);
  std::string text =
      fmt::format(".TH {} 1 \"\" \"{}\" \"User Commands\"\n.SH NAME\n{} \\- {}\n",
                  CLI::detail::to_lower(title), roff(version), roff(title), roff(command.get_description()));
  text += fmt::format(".SH SYNOPSIS\n\\fB{}\\fR [\\fIOPTIONS\\fR]", roff(full_name(command)));
  for (const CLI::Option* argument : arguments) {
    const std::string name =
        "\\fI" + roff(argument->get_name(true)) + "\\fR" + (argument->get_expected_max() > 1 ? "..." : "");
    text += argument->get_required() ? " " + name : " [" + name + "]";
  }
  text += commands.empty() ? "\n" : " \\fICOMMAND\\fR ...\n";
  if (!commands.empty()) {
    text += ".SH COMMANDS\n";
    for (const CLI::App* inner : commands) {
      text += fmt::format(".TP\n\\fB{}\\fR\n{}; see \\fB{}\\fR(1)\n", roff(inner->get_name()),
                          roff(inner->get_description()), roff(page_title(*inner)));
    }
  }
  if (!arguments.empty()) {
    text += ".SH ARGUMENTS\n";
    for (const CLI::Option* argument : arguments) {
      text += fmt::format(".TP\n\\fI{}\\fR\n{}\n", roff(argument->get_name(true)),
                          roff(argument->get_description()));
    }
  }
  text += ".SH OPTIONS\n";
  for (const CLI::Option* option : options_of(command)) {
    text += option_entry(*option);
  }
  text += notes(command.get_footer());
  const CLI::App* parent = command.get_parent();
  text +=
      fmt::format(".SH SEE ALSO\n\\fB{}\\fR(1)\n", roff(parent != nullptr  ? page_title(*parent)
                                                        : commands.empty() ? page_title(command)
                                                                           : page_title(*commands.front())));
  return text;
}

}  // namespace trestle::program
