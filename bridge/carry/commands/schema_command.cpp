#include <cstdio>

#include "bridge/carry/commands/carry_commands.hpp"
#include "bridge/carry/config/schema.hpp"
#include "bridge/cli/option.hpp"

namespace trestle::carry {

void add_schema_command(CLI::App& app, int& /*status*/) {
  CLI::App* command = app.add_subcommand("schema", "Print a JSON Schema of configurations, for editors");
  command->footer(
      "Editors that know yaml-language-server then complete keys and mark mistakes while one types, in\n"
      "files that name the schema:\n"
      "  # yaml-language-server: $schema=trestle.schema.json\n"
      "'trestle check' finds more: a schema cannot say how values go together.\n\n"
      "Examples:\n"
      "  trestle schema > trestle.schema.json");
  command->callback([] { std::fputs(config_schema().c_str(), stdout); });
}

}  // namespace trestle::carry
