#include "bridge/program/self_commands.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <CLI/CLI.hpp>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <memory>
#include <string>
#include <system_error>
#include <vector>

#include "bridge/cli/exit_status.hpp"
#include "bridge/cli/option.hpp"
#include "bridge/documents/problems.hpp"
#include "bridge/program/command_model.hpp"
#include "bridge/program/completion.hpp"
#include "bridge/program/man_page.hpp"

namespace trestle::program {
namespace {

bool write_pages(const CLI::App& app, const std::string& folder, const char* version) {
  std::error_code failure;
  std::filesystem::create_directories(folder, failure);
  for (const CLI::App* command : all_commands(app)) {
    const std::filesystem::path file = std::filesystem::path{folder} / man_page_name(*command);
    std::ofstream out{file};
    out << man_page(*command, version) << std::flush;
    if (!out) {
      std::fprintf(stderr, "cannot write %s\n", file.c_str());
      return false;
    }
  }
  return true;
}

/// The command that these words lead to; null: there is none.
const CLI::App* find(const CLI::App& app, const std::vector<std::string>& words) {
  const CLI::App* found = &app;
  for (const std::string& word : words) {
    const CLI::App* next = nullptr;
    for (const CLI::App* command : commands_of(*found)) {
      next = command->get_name() == word ? command : next;
    }
    if (next == nullptr) {
      return nullptr;
    }
    found = next;
  }
  return found;
}

}  // namespace

void add_completion_command(CLI::App& app) {
  CLI::App* completion =
      app.add_subcommand("completion", "Print a script by which a shell completes commands");
  completion->footer(
      "Packages install these scripts. Without one:\n\n"
      "Examples:\n"
      "  source <(trestle completion bash)\n"
      "  trestle completion zsh > ~/.zfunc/_trestle\n"
      "  trestle completion fish > ~/.config/fish/completions/trestle.fish");
  const auto shell = std::make_shared<std::string>();
  completion->add_option("SHELL", *shell, "bash, zsh or fish")
      ->required()
      ->check(CLI::IsMember({"bash", "zsh", "fish"}));
  completion->callback([&app, shell] {
    const std::string script = *shell == "bash"  ? bash_completion(app)
                               : *shell == "zsh" ? zsh_completion(app)
                                                 : fish_completion(app);
    std::fputs(script.c_str(), stdout);
  });
}

void add_man_command(CLI::App& app, int& status, const char* version) {
  CLI::App* man = app.add_subcommand("man", "Print a command's page of the manual, or write all pages");
  man->footer(
      "Packages install the pages: 'man trestle', 'man trestle-check'.\n\n"
      "Examples:\n"
      "  trestle man conform run | man -l -\n"
      "  trestle man --output ~/.local/share/man/man1");
  const auto words = std::make_shared<std::vector<std::string>>();
  const auto folder = std::make_shared<std::string>();
  man->add_option("COMMAND", *words, "The command; without one, the program");
  cli::option(*man, "-o,--output", *folder, "DIR", "Write the pages of all commands into this folder");
  man->callback([&app, &status, words, folder, version] {
    if (!folder->empty()) {
      status = write_pages(app, *folder, version) ? cli::exit_ok : cli::exit_failure;
      return;
    }
    const CLI::App* command = find(app, *words);
    if (command == nullptr) {
      std::fprintf(stderr, "There is no command '%s'\n",
                   documents::printable(fmt::format("{}", fmt::join(*words, " "))).c_str());
      status = cli::exit_usage;
      return;
    }
    std::fputs(man_page(*command, version).c_str(), stdout);
  });
}

}  // namespace trestle::program
