#include <fmt/format.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <filesystem>
#include <memory>

#include "bridge/cli/exit_status.hpp"
#include "bridge/cli/options.hpp"
#include "bridge/cli/terminal.hpp"
#include "bridge/documents/quote_path.hpp"
#include "bridge/documents/section.hpp"
#include "bridge/generate/explanation.hpp"
#include "bridge/generate/generate_commands.hpp"
#include "bridge/generate/service_explanation.hpp"
#include "bridge/messages/types/interface_name.hpp"

namespace trestle::generate {
namespace {

struct ExplainArguments {
  SourceArguments sources;
  std::string element;
  std::vector<std::string> interfaces;
  std::string values;
  bool json = false;
};

/// The text itself, or that of the file of this name, which may be a pipe, or behind '@'; "-": standard
/// input.
cli::TextArgument values_of(const std::string& argument) {
  constexpr const char* option = "--values";
  if (argument == "-") {
    return cli::text_of_argument(option, option, "@-");
  }
  const bool is_name = !argument.starts_with('@') && argument.find_first_of("{}\n:") == std::string::npos;
  std::error_code ignored;
  if (is_name && std::filesystem::exists(argument, ignored) &&
      !std::filesystem::is_directory(argument, ignored)) {
    return cli::text_of_argument(option, option, "@" + argument);
  }
  if (is_name && (argument.ends_with(".yaml") || argument.ends_with(".yml") || argument.ends_with(".json"))) {
    throw CLI::ValidationError{option, "there is no file " + documents::quote_path(argument)};
  }
  return cli::text_of_argument(option, option, argument);
}

/// Whether a source stands where the element does: then all is wanted that there is. A folder may have the
/// name of a service.
bool is_source(const std::string& element, bool has_sources) {
  std::error_code ignored;
  return has_sources ? std::filesystem::is_regular_file(element, ignored)
                     : std::filesystem::exists(element, ignored);
}

int run_explain(ExplainArguments& arguments) {
  std::vector<std::string>& sources = arguments.sources.sources;
  sources.insert(sources.end(), arguments.interfaces.begin(), arguments.interfaces.end());
  const bool wants_all = is_source(arguments.element, !sources.empty());
  if (wants_all) {
    sources.insert(sources.begin(), arguments.element);
    if (!arguments.values.empty()) {
      throw CLI::ValidationError{"--values", "are those of one element: which one?"};
    }
  } else if (sources.empty()) {
    if (!messages::interface_name(arguments.element)) {
      throw CLI::ValidationError{
          "SOURCE", fmt::format("is needed: which files describe {}? There is no file of this name",
                                documents::quote(arguments.element))};
    }
    sources = {arguments.element};  // a ROS type says it all
  }
  arguments.sources.options.lowers = !wants_all;
  const describe::System system = arguments.sources.read();
  if (!system.good) {
    return cli::exit_usage;
  }
  if (wants_all) {
    const Contents contents = contents_of(system);
    fmt::print("{}", arguments.json ? to_json_text(contents) : to_text(contents));
    return cli::exit_ok;
  }
  cli::TextArgument values = arguments.values.empty() ? cli::TextArgument{} : values_of(arguments.values);
  if (!arguments.values.empty() && values.text.empty()) {
    values.text = "{}";  // an empty file says nothing of any value
  }
  const auto fail = [](const std::string& why) {
    const cli::Colours colour = cli::colours_for(STDERR_FILENO);
    fmt::print(stderr, "{}error:{} {}\n", colour.red, colour.off, why);
    return cli::exit_usage;
  };
  const auto explained = explain(system, arguments.element, values.text, values.name);
  if (!explained) {
    const auto service = explain_service(system, arguments.element);
    if (!service || !*service) {
      return fail(service ? explained.error() : service.error());
    }
    if (!arguments.values.empty()) {
      return fail(
          fmt::format("{} is a service, and values are those of one of its members", (*service)->name));
    }
    fmt::print("{}", arguments.json ? to_json_text(**service) : to_text(**service));
    return cli::exit_ok;
  }
  if (arguments.json) {
    fmt::print("{}", to_json_text(*explained));
  } else {
    for (const Explanation& one : *explained) {
      fmt::print("{}", to_text(one));
    }
  }
  return cli::exit_ok;
}

}  // namespace

void add_explain_command(CLI::App& app, int& status, const SourceReaders& readers) {
  const auto arguments = std::make_shared<ExplainArguments>();
  arguments->sources = SourceArguments{readers};
  CLI::App* command = app.add_subcommand("explain", "Show which bytes of a message belong to which field");
  command
      ->add_option(
          "ELEMENT", arguments->element,
          "An event, method or field, such as Door.open or Door.open.response, a type, or a service; "
          "without one: list what there is")
      ->required();
  arguments->sources.add_to(*command);
  command->get_option("SOURCE")->required(false);
  command->add_option("--interfaces", arguments->interfaces, "More sources")->type_name("FILE");
  command
      ->add_option(
          "--values", arguments->values,
          "Values in YAML or JSON, or a file with them, - for standard input: also shows the bytes of "
          "these values")
      ->type_name("YAML|FILE");
  command->add_flag("--json", arguments->json, "Print JSON");
  command->footer(
      "Each line is a range of bytes: offset, size, field, type and rule; with --values also bytes and "
      "value; below stand the names of enumerations. A service is shown with its members, their ids and "
      "values.\nWith sources alone, all services and types are listed.\n" +
      source_forms() +
      "\n\nExamples:\n"
      "  trestle explain Door.fidl Door.fdepl\n"
      "  trestle explain Door.open Door.fidl Door.fdepl\n"
      "  trestle explain Door Door.fidl Door.fdepl\n"
      "  trestle explain Door.moved car.arxml --values '{position: 7}'\n"
      "  trestle explain Door.moved car.arxml --values - < moved.yaml\n"
      "  trestle explain sensor_msgs/msg/PointCloud2 --json\n"
      "Exit status: 0, or 2 when a source or a value is wrong or there is no such element.");
  command->callback([arguments, &status] { status = run_explain(*arguments); });
}

}  // namespace trestle::generate
