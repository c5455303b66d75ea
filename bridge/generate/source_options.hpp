#pragma once
#include <CLI/CLI.hpp>
#include <optional>
#include <string>
#include <vector>

#include "bridge/describe/allocate.hpp"
#include "bridge/describe/system.hpp"
#include "bridge/generate/page.hpp"

namespace trestle::generate {

/// What commands have in common that read descriptions: the sources, --lock, --keep-event-ids.
class SourceArguments {
 public:
  void add_to(CLI::App& command);

  /// Reads files, folders and captures, and makes a system of them. Problems are printed on standard error.
  /// @return the system; not good when there was an error.
  [[nodiscard]] describe::System read();
  /// Reads the same for the page of --ui, which reads it again after each change: the texts of the files, and
  /// of all that these import, and what captures told. Problems of files that cannot be opened are printed.
  /// @return nothing when there is such a problem.
  [[nodiscard]] std::optional<Page::Settings> load();
  /// Keeps the ids that read() chose in the file of --lock, if there are new ones and there is a file.
  /// @throws std::runtime_error when it cannot be written.
  void keep_ids() const;

  std::vector<std::string> sources{};
  std::string lock_file{};
  describe::SystemOptions options{};

 private:
  /// What is read, before it is.
  struct Opened {
    std::vector<describe::SourceText> texts{};
    describe::Model captured{};
    std::vector<documents::Problem> problems{};
  };
  [[nodiscard]] Opened open() const;
  void read_lock(std::vector<documents::Problem>& problems);

  bool keep_event_ids_ = false;
  std::string text_before_{};
  describe::IdLock lock_{};
};

/// Captures are told by their names: they have no text.
[[nodiscard]] bool is_capture(const std::string& name);

/// Prints problems to standard error, in colours for people.
void print_problems(const std::vector<documents::Problem>& problems);

}  // namespace trestle::generate
