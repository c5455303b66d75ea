#include "bridge/generate/source_options.hpp"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <stdexcept>
#include <tuple>
#include <utility>

#include "bridge/cli/terminal.hpp"
#include "bridge/describe/join.hpp"
#include "bridge/describe/sources/sources.hpp"
#include "bridge/documents/document.hpp"
#include "bridge/generate/capture_model.hpp"

namespace trestle::generate {

bool is_capture(const std::string& name) {
  return name.ends_with(".pcap") || name.ends_with(".pcapng") || name.ends_with(".cap");
}

void SourceArguments::add_to(CLI::App& command) {
  command
      .add_option(
          "SOURCE", sources,
          "FIDL, FDEPL, ARXML, vsomeip JSON, .msg, .srv, .action or .idl files, folders of them, or captures")
      ->required();
  command.add_option("--lock", lock_file, "Where ids that are chosen are kept")->type_name("FILE");
  command.add_flag("--keep-event-ids", keep_event_ids_,
                   "Take event ids of ARXML as they are; otherwise those below 0x8000 get bit 15");
}

SourceArguments::Opened SourceArguments::open() const {
  Opened opened;
  std::vector<std::string> files;
  for (const std::string& source : sources) {
    if (!is_capture(source)) {
      files.push_back(source);
      continue;
    }
    describe::Reading one = read_capture(source);
    describe::append(opened.captured, std::move(one.model));
    opened.problems.insert(opened.problems.end(), one.problems.begin(), one.problems.end());
  }
  opened.texts = describe::load_sources(files, opened.problems);
  return opened;
}

describe::System SourceArguments::read() {
  Opened opened = open();
  describe::Reading reading =
      describe::read_sources(opened.texts, describe::file_loader(), {.set_event_bit = !keep_event_ids_});
  reading.problems.insert(reading.problems.begin(), opened.problems.begin(), opened.problems.end());
  if (!opened.captured.files.empty() && reading.ok()) {
    describe::append(reading.model, std::move(opened.captured));
    std::vector<documents::Problem> contradictions = describe::join(reading.model);
    reading.problems.insert(reading.problems.end(), contradictions.begin(), contradictions.end());
  }
  read_lock(reading.problems);
  describe::System system = make_system(std::move(reading), lock_, options);
  print_problems(system.problems);
  return system;
}

void SourceArguments::read_lock(std::vector<documents::Problem>& problems) {
  std::error_code ignored;
  if (!lock_file.empty() && std::filesystem::exists(lock_file, ignored)) {
    const auto text = documents::read_text_file(lock_file);
    if (!text) {
      problems.push_back({.file = lock_file, .mark = {}, .text = text.error()});
    } else if (auto lock = describe::read_id_lock(lock_file, *text)) {
      lock_ = std::move(*lock);
      text_before_ = *text;
    } else {
      problems.insert(problems.end(), lock.error().begin(), lock.error().end());
    }
  }
}

std::optional<Page::Settings> SourceArguments::load() {
  Opened opened = open();
  // Imports are read now: the page opens no file.
  Page::Settings settings{.files = opened.texts, .captured = std::move(opened.captured)};
  settings.set_event_bit = !keep_event_ids_;
  const describe::Load load = describe::file_loader();
  std::ignore = describe::read_sources(opened.texts, [&](const std::string& name) {
    auto text = load(name);
    if (text) {
      settings.files.push_back({name, *text});
    }
    return text;
  });
  read_lock(opened.problems);
  settings.lock = lock_;
  print_problems(opened.problems);
  const bool bad = std::ranges::any_of(opened.problems, [](const documents::Problem& one) {
    return one.severity == documents::Problem::Severity::error;
  });
  return bad ? std::nullopt : std::optional{std::move(settings)};
}

void SourceArguments::keep_ids() const {
  const std::string text = to_text(lock_);
  if (lock_file.empty() || lock_.services.empty() || text == text_before_) {
    return;
  }
  std::ofstream out{lock_file, std::ios::binary};
  if (!(out << text) || !out.flush()) {
    throw std::runtime_error{fmt::format("{} cannot be written", lock_file)};
  }
}

void print_problems(const std::vector<documents::Problem>& problems) {
  const cli::Colours colour = cli::colours_for(STDERR_FILENO);
  for (const documents::Problem& problem : problems) {
    const bool error = problem.severity == documents::Problem::Severity::error;
    fmt::print(stderr, "{}{}{}\n", error ? colour.red : colour.yellow, to_string(problem), colour.off);
  }
}

}  // namespace trestle::generate
