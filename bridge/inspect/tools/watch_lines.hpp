#pragma once
#include <functional>
#include <map>
#include <optional>
#include <string>

#include "bridge/inspect/tools/sighting_text.hpp"
#include "bridge/inspect/tools/watcher.hpp"

namespace trestle::inspect {

/// What `trestle watch` prints line by line: what happens, and now and then rates.
class WatchLines {
 public:
  struct Options {
    bool json = false;
    Duration rates{};                             ///< how often they are told; 0: never
    std::uint64_t count = 0;                      ///< lines; more are not printed. 0: all
    const describe::Interfaces* names = nullptr;  ///< null: everything is told by its ids
  };

  /// @param print  gets each line with its end.
  /// @param full   called when there were `count` lines.
  WatchLines(const Options& options, std::function<void(const std::string&)> print,
             std::function<void()> full)
      : options_{options}, print_{std::move(print)}, full_{std::move(full)} {}

  void tell(const std::vector<traffic::Sighting>& sightings, TimePoint now);
  /// Prints the rates since the last time, if they are due; without those of idle things.
  /// @param at_once  they are due: the program ends.
  void tell_rates(const Watcher& seen, TimePoint now, bool at_once = false);

  /// Whether there were as many lines as there should be.
  [[nodiscard]] bool enough() const noexcept { return options_.count == 0 || lines_ == options_.count; }

 private:
  struct Told {
    std::uint64_t messages = 0;
    std::uint64_t bytes = 0;
  };

  void tell_rate(const SeenTraffic& row, const InstanceNames& names, const Rate& rate, TimePoint now);
  void line(const std::string& text);

  Options options_;
  std::function<void(const std::string&)> print_;
  std::function<void()> full_;
  std::uint64_t lines_ = 0;
  std::optional<TimePoint> last_;
  std::map<TrafficView::Key, Told> told_;
};

}  // namespace trestle::inspect
