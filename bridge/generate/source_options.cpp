#include "bridge/generate/source_options.hpp"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <stdexcept>

#include "bridge/cli/terminal.hpp"
#include "bridge/describe/join.hpp"
#include "bridge/describe/sources/sources.hpp"
#include "bridge/documents/document.hpp"
#include "bridge/generate/capture_model.hpp"

namespace trestle::generate {
namespace {

/// Captures are told by their names: they have no text.
bool is_capture(const std::string& name) {
  return name.ends_with(".pcap") || name.ends_with(".pcapng") || name.ends_with(".cap");
}

}  // namespace

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

describe::System SourceArguments::read() {
  std::vector<documents::Problem> problems;
  std::vector<std::string> files;
  describe::Reading captured;
  for (const std::string& source : sources) {
    if (!is_capture(source)) {
      files.push_back(source);
      continue;
    }
    describe::Reading one = read_capture(source);
    describe::append(captured.model, std::move(one.model));
    problems.insert(problems.end(), one.problems.begin(), one.problems.end());
  }
  const std::vector<describe::SourceText> texts = describe::load_sources(files, problems);
  describe::Reading reading =
      describe::read_sources(texts, describe::file_loader(), {.set_event_bit = !keep_event_ids_});
  reading.problems.insert(reading.problems.begin(), problems.begin(), problems.end());
  if (!captured.model.files.empty() && reading.ok()) {
    describe::append(reading.model, std::move(captured.model));
    std::vector<documents::Problem> contradictions = describe::join(reading.model);
    reading.problems.insert(reading.problems.end(), contradictions.begin(), contradictions.end());
  }
  std::error_code ignored;
  if (!lock_file.empty() && std::filesystem::exists(lock_file, ignored)) {
    const auto text = documents::read_text_file(lock_file);
    if (!text) {
      reading.problems.push_back({.file = lock_file, .mark = {}, .text = text.error()});
    } else if (auto lock = describe::read_id_lock(lock_file, *text)) {
      lock_ = std::move(*lock);
      text_before_ = *text;
    } else {
      reading.problems.insert(reading.problems.end(), lock.error().begin(), lock.error().end());
    }
  }
  describe::System system = make_system(std::move(reading), lock_, options);
  print_problems(system.problems);
  return system;
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
