#pragma once
#include <array>
#include <boost/asio/any_io_executor.hpp>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "bridge/carry/config/lock_file.hpp"
#include "bridge/carry/runtime/route_context.hpp"
#include "bridge/carry/runtime/routes.hpp"
#include "bridge/carry/runtime/silence_watch.hpp"
#include "bridge/messages/types/type_library.hpp"

namespace trestle::carry {

/// The routes of patterns to SOME/IP: one for each topic that matches, has a type that is known, and is
/// published by somebody else; it ends with its last publisher. The ids come from the lock file; new ids are
/// written there before they are offered. On the thread that runs the io_context.
class DiscoveredRoutes {
 public:
  /// Opens the ports of the patterns and reads the lock file.
  /// @param context  of all routes, which has joined SOME/IP; outlives this object.
  /// @param routes  of the bridge, to which those of the patterns are added. Ends before this object.
  /// @param types  is copied: a later publisher may have a type that nobody has asked for yet.
  /// @param disk  where the lock file is written: until that is on the disk may take a while, in which
  /// everything else goes on.
  /// @throws std::runtime_error  with the place in the configuration or lock file.
  DiscoveredRoutes(const RouteContext& context, Routes& routes, const BridgeConfig& config,
                   const messages::TypeLibrary& types, boost::asio::any_io_executor disk);
  DiscoveredRoutes(const DiscoveredRoutes&) = delete;
  DiscoveredRoutes& operator=(const DiscoveredRoutes&) = delete;

  /// Makes routes for the publishers that are there, once DDS has been joined.
  void open();
  /// To be called when writers have come or gone, or counterparts of our readers. What comes together, or
  /// soon after, is looked at together.
  void changed();
  /// Nothing begins or ends any more.
  void stop();

  /// Told of each route that is made, and of the topics of those that end.
  /// Also after each look at what is there, by which the state of a pattern may have become another.
  struct Watcher {
    std::function<void(const RunningRoute& route)> made;
    std::function<void(const std::string& topic)> ends;
    std::function<void()> looked;
  };
  void watched_by(Watcher watcher) { watcher_ = std::move(watcher); }
  /// Why a pattern has had no route yet, of either direction.
  void append_silence(SilenceWatch& silence);
  /// How each pattern is.
  void append_pictures(std::vector<RoutePicture>& pictures) const;
  /// The state of each pattern to SOME/IP: OK while it has a route.
  void append_diagnoses(std::vector<Diagnosis>& diagnoses) const;

  /// Those of the patterns, and of all routes that there were.
  void append_counters(std::vector<CounterGroup>& groups) const;

 private:
  /// Why a topic that matches has no route.
  enum class Refusal : std::uint8_t {
    unknown_type,  ///< its type is not known, or cannot be carried
    other_type,    ///< it has, or had when it got its id, another type
    too_many,      ///< as many topics as are allowed have an id already
    no_id,         ///< all ids of the range are taken
    not_locked,    ///< the lock file could not be written
    not_opened,    ///< a port or the DDS reader could not be opened
  };
  static constexpr std::size_t refusals = 6;

  struct Pattern {
    const TopicPattern* settings = nullptr;
    std::shared_ptr<const void> port;  ///< held also while there are no routes
    std::size_t topics = 0;            ///< that match now
    bool brought = false;              ///< other bridges publish some that match
    std::size_t locked = 0;            ///< that have an id
    std::uint64_t made = 0;
    std::array<std::uint64_t, refusals> refused{};
  };
  /// What discovery says of a topic's writers that have one type.
  struct Found {
    Pattern* pattern = nullptr;
    PublishedQos offers;
  };
  using TopicAndType = std::pair<std::string, std::string>;
  struct Live {
    Pattern* pattern;
    Route route;
    RunningRoute* running;  ///< one of the bridge's routes
  };
  struct Candidate {
    Pattern* pattern;
    Route route;
    bool is_new;  ///< its id is not locked yet
  };

  void update();
  [[nodiscard]] std::map<TopicAndType, Found> look();
  void drop_what_is_gone(const std::map<TopicAndType, Found>& found);
  void drop(std::map<std::string, Live>::iterator live);
  /// The pattern to SOME/IP that has this topic, or nothing.
  [[nodiscard]] Pattern* owner_of(const std::string& topic);
  /// Adds the route of a topic, unless it has one or cannot have one.
  void consider(const TopicAndType& what, const Found& found, std::vector<Candidate>& candidates);
  [[nodiscard]] bool has_known_type(const Route& route, Pattern& pattern);
  [[nodiscard]] std::optional<someip::ServiceId> new_id(const TopicAndType& what, Pattern& pattern);
  /// Writes the ids of new topics to the lock file, and removes the candidates that have an id already.
  void lock(std::vector<Candidate>& candidates);
  /// The ids of new topics are in `file` now, or could not be written.
  void locked(LockFile file, const tl::expected<void, std::string>& written);
  void make(const Candidate& candidate);
  [[nodiscard]] std::size_t routes_of(const Pattern& pattern) const;
  [[nodiscard]] CounterGroup counters_of(const Pattern& pattern) const;
  [[nodiscard]] RoutePicture picture_of_pattern(const Pattern& pattern) const;
  void refuse(const TopicAndType& what, Pattern& pattern, Refusal why, const std::string& told);

  const RouteContext& context_;
  /// Of these routes, once DDS has been joined: this object watches who comes and goes.
  std::optional<RouteContext> own_;
  Routes& routes_;  ///< of the bridge
  const BridgeConfig config_;
  messages::TypeLibrary types_;
  LockFile lock_;
  std::vector<Pattern> patterns_;            ///< as those of the configuration
  std::set<std::string> own_topics_;         ///< that others of our routes carry
  std::set<someip::ServiceId> taken_;        ///< ids of services, also those that are locked
  std::map<std::string, Pattern*> owners_;   ///< of the topics that are there; nothing: no pattern's
  std::map<std::string, Live> live_;         ///< by topic
  std::map<TopicAndType, Refusal> refused_;  ///< of what is there
  std::set<std::string> told_;               ///< lines that need not be logged again
  CounterGroup past_;                        ///< sums of the routes that there were
  Watcher watcher_;
  const std::unique_ptr<RouteTimer> next_look_;
  RouteClock::TimePoint last_{};
  bool stopped_ = false;
  std::vector<Candidate> being_locked_;  ///< until then nothing else is looked at
  bool locking_ = false;
  bool missed_ = false;  ///< something has changed meanwhile
  std::shared_ptr<bool> alive_ = std::make_shared<bool>(true);
  const boost::asio::any_io_executor disk_;
};

}  // namespace trestle::carry
