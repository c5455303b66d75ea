#pragma once
#include <CLI/CLI.hpp>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "bridge/cli/options.hpp"
#include "bridge/describe/sources/kept_ids.hpp"
#include "bridge/describe/sources/sources.hpp"
#include "bridge/describe/system.hpp"
#include "bridge/generate/folder_lock.hpp"
#include "bridge/generate/page.hpp"
#include "dds_adapter/participant.hpp"

namespace trestle::generate {

/// How sources of other rooms are read: `bridge/program` knows both.
struct SourceReaders {
  std::function<describe::Reading(const std::string& file)> route_file{};
  std::function<describe::TypeOrigins(const std::string& file)> types_of_route_file{};
  /// @throws std::runtime_error when the domain cannot be joined.
  std::function<std::vector<dds::FoundWriter>(std::optional<std::uint32_t> domain, double seconds)> ros{};
};

/// What a source on the command line is.
enum class SourceForm : std::uint8_t {
  file,        ///< or a folder of files
  capture,     ///< "drive.pcapng"
  route_file,  ///< "bridge.yaml"
  type,        ///< "sensor_msgs/msg/PointCloud2", "std_srvs/SetBool"
  network,     ///< "network", "network:eth0", "network:192.168.1.10"
  ros,         ///< "ros", "ros:42": all of a domain
  topic,       ///< "/points": of a topic, service or action in the domain
};

/// A file that is there is a file, whatever its name.
[[nodiscard]] SourceForm form_of(const std::string& source);

/// What a source may be, for --help.
[[nodiscard]] std::string source_forms();

/// What commands have in common that read descriptions: the sources, --types, --lock, --keep-event-ids, and
/// for live sources --for, --multicast, --sd-port.
class SourceArguments {
 public:
  explicit SourceArguments(SourceReaders readers = {}) : readers_{std::move(readers)} {}
  void add_to(CLI::App& command);

  /// Changes what was read, before ids are chosen.
  using Change = std::function<std::vector<documents::Problem>(describe::Model& model)>;

  /// Reads all sources and makes a system of them. Problems are printed on standard error.
  /// @return the system; not good when there was an error.
  /// @throws std::runtime_error when a live ROS graph cannot be seen.
  [[nodiscard]] describe::System read(const Change& change = {});
  /// Reads the same for the page of --ui, which reads it again after each change: the texts of the files, and
  /// of all that these import, and what other sources told. Problems of files that cannot be opened are
  /// printed.
  /// @return nothing when there is such a problem.
  [[nodiscard]] std::optional<Page::Settings> load();
  /// Where a route file finds the types of these sources, seen from the working directory.
  /// @param only_of_ros  leaves out those that are written as packages of messages.
  [[nodiscard]] describe::TypeOrigins origins_of_types(bool only_of_ros) const;
  /// Keeps the ids that read() chose, if there are new ones: in the file of --lock, else in the one beside
  /// the sources, else in the folder of the output. Needs `keeps_ids`.
  /// @throws std::runtime_error when it cannot be written.
  void keep_ids();

  /// The files that read() has read, those of folders included.
  [[nodiscard]] const std::vector<std::string>& files() const noexcept { return files_; }

  std::vector<std::string> sources{};
  std::string output_folder{};  ///< of the output; empty: there is none
  /// From read() on, no other run uses the folder of the output, nor the file of the kept ids until
  /// keep_ids(). Then read() throws std::runtime_error when another one takes too long.
  bool keeps_ids = false;
  describe::SystemOptions options{};
  cli::NetworkOptions network{};  ///< of live sources, without an address

 private:
  /// What is read, before it is.
  struct Opened {
    std::vector<describe::SourceText> texts{};
    describe::Model captured{};  ///< of all sources that are no texts
    std::vector<documents::Problem> problems{};
  };
  [[nodiscard]] Opened open();
  void read_live(describe::Reading& into) const;
  void read_lock(std::vector<documents::Problem>& problems);
  [[nodiscard]] std::vector<std::string> paths() const;
  [[nodiscard]] std::string own_lock() const;
  void lock_ids();
  /// What keep_ids() writes, and to which file; nothing: there is nothing new.
  [[nodiscard]] std::optional<describe::SourceText> new_ids() const;

  SourceReaders readers_;
  bool keep_event_ids_ = false;
  std::vector<std::string> type_folders_{};
  double seconds_ = 5;
  std::string lock_file_{};
  std::vector<std::string> files_{};
  describe::KeptIds kept_{};  ///< as they were before read()
  describe::IdLock lock_{};   ///< with those that read() chose
  std::unique_ptr<FolderLock> output_lock_{};
  std::vector<std::unique_ptr<FolderLock>> id_locks_{};
};

/// Captures are told by their names: they have no text.
[[nodiscard]] bool is_capture(const std::string& name);

/// Prints problems to standard error, in colours for people.
void print_problems(const std::vector<documents::Problem>& problems);

}  // namespace trestle::generate
