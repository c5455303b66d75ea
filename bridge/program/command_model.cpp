#include "bridge/program/command_model.hpp"

#include <algorithm>
#include <array>
#include <string_view>

namespace trestle::program {
namespace {

std::vector<const CLI::Option*> visible(const CLI::App& app, bool positional) {
  return app.get_options([positional](const CLI::Option* option) {
    return !option->get_group().empty() && option->get_positional() == positional;
  });
}

}  // namespace

std::string value_name(const CLI::Option& option) {
  if (option.get_type_size() == 0) {
    return {};
  }
  const std::string type = option.get_type_name();  // "N:INT in [1 - 65535]"
  auto end = type.find(':');
  while (end != std::string::npos && end > 0 && type[end - 1] == '[') {  // "ID[:TYPE]"
    end = type.find(':', end + 1);
  }
  return type.substr(0, end);
}

std::vector<std::string> value_words(const CLI::Option& option) {
  const std::string type = option.get_type_name();  // "ROLE:{server,client}"
  const auto begin = type.find(":{");
  const auto end = type.find('}', begin == std::string::npos ? 0 : begin);
  std::vector<std::string> words;
  if (begin == std::string::npos || end == std::string::npos) {
    return words;
  }
  for (const std::string& word : CLI::detail::split(type.substr(begin + 2, end - begin - 2), ',')) {
    words.push_back(CLI::detail::trim_copy(word));
  }
  return words;
}

bool is_file(const CLI::Option& option) {
  constexpr std::array<std::string_view, 5> files{"FILE", "FOLDER", "DIR", "CAPTURE", "SOURCE"};
  const std::string name = option.get_positional() ? option.get_name(true) : value_name(option);
  return std::ranges::any_of(files,
                             [&](std::string_view file) { return name.find(file) != std::string::npos; });
}

std::vector<const CLI::App*> commands_of(const CLI::App& app) {
  return app.get_subcommands([](const CLI::App* command) { return !command->get_group().empty(); });
}

std::vector<const CLI::Option*> options_of(const CLI::App& app) {
  return visible(app, false);
}

std::vector<const CLI::Option*> arguments_of(const CLI::App& app) {
  return visible(app, true);
}

std::vector<std::string> names_of(const CLI::Option& option) {
  std::vector<std::string> names;
  for (const std::string& name : option.get_lnames()) {
    names.push_back("--" + name);
  }
  for (const std::string& name : option.get_snames()) {
    names.push_back("-" + name);
  }
  return names;
}

std::string full_name(const CLI::App& app) {
  return app.get_parent() == nullptr ? app.get_name() : full_name(*app.get_parent()) + " " + app.get_name();
}

std::vector<const CLI::App*> all_commands(const CLI::App& app) {
  std::vector<const CLI::App*> all{&app};
  for (const CLI::App* command : commands_of(app)) {
    const std::vector<const CLI::App*> inner = all_commands(*command);
    all.insert(all.end(), inner.begin(), inner.end());
  }
  return all;
}

}  // namespace trestle::program
