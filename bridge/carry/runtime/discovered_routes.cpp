#include "bridge/carry/runtime/discovered_routes.hpp"

#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include <algorithm>
#include <boost/asio/io_context.hpp>
#include <boost/asio/post.hpp>
#include <stdexcept>

#include "bridge/carry/config/id_allocator.hpp"
#include "bridge/carry/config/pattern_conflicts.hpp"
#include "bridge/carry/runtime/bridge_mark.hpp"
#include "bridge/carry/runtime/make_routes.hpp"
#include "bridge/carry/runtime/route_parts.hpp"
#include "bridge/carry/runtime/start_at.hpp"
#include "bridge/documents/problems.hpp"
#include "bridge/messages/types/names.hpp"
#include "dds_adapter/ros_names.hpp"

namespace trestle::carry {
namespace {

using namespace std::chrono_literals;

// A look at all writers costs up to some milliseconds, and others decide how often they change.
constexpr auto pause_between_looks = 50ms;
// A full disk may be emptied.
constexpr auto pause_before_locking_again = 10s;
// Lines about topics that get no route: peers choose the names.
constexpr std::size_t told_max = 1000;

LockFile read_lock(const std::string& file) {
  auto lock = LockFile::read(file);
  if (!lock) {
    throw std::runtime_error{to_string(lock.error().front())};
  }
  return std::move(*lock);
}

std::string in_words(const Route& route) {
  return fmt::format("service 0x{:04x} instance 0x{:04x}", someip::value(route.service),
                     someip::value(route.instance));
}

}  // namespace

DiscoveredRoutes::DiscoveredRoutes(const RouteContext& context, Routes& routes, const BridgeConfig& config,
                                   const messages::TypeLibrary& types, boost::asio::any_io_executor disk)
    : context_{context},
      routes_{routes},
      config_{config},
      types_{types},
      lock_{read_lock(config.lock_file)},
      past_{"former routes of patterns", {}},
      next_look_{context.clock.timer([this] { update(); })},
      disk_{std::move(disk)} {
  patterns_.resize(config_.patterns.size());
  for (std::size_t i = 0; i < patterns_.size(); ++i) {
    const TopicPattern& settings = config_.patterns[i];
    patterns_[i].settings = &settings;
    if (settings.route.direction == Direction::dds_to_someip) {
      patterns_[i].port = start_at(config, settings.mark, [&] {
        return context.someip->hold_port(settings.route.port, settings.route.transport);
      });
    }
  }
  for (const Route& route : config.routes) {
    own_topics_.insert(route.topic);
    if (route.e2e && route.direction == Direction::someip_to_dds) {
      own_topics_.insert(config.diagnostics.topic);
    }
    taken_.insert(route.service);
  }
  for (const MethodRoute& method : config.methods) {
    taken_.insert(method.service);
  }
  for (const LockedTopic& locked : lock_.topics()) {
    taken_.insert(locked.service);
    if (Pattern* const owner = owner_of(locked.topic)) {
      ++owner->locked;
    }
  }
}

DiscoveredRoutes::Pattern* DiscoveredRoutes::owner_of(const std::string& topic) {
  const TopicPattern* const settings = pattern_of(config_.patterns, topic);
  return settings != nullptr && settings->route.direction == Direction::dds_to_someip
             ? &patterns_[static_cast<std::size_t>(settings - config_.patterns.data())]
             : nullptr;
}

void DiscoveredRoutes::open() {
  own_.emplace(context_);
  own_->watch = nullptr;
  own_->publishers = nullptr;
  update();
}

void DiscoveredRoutes::changed() {
  const auto when = std::max(context_.clock.now(), last_ + pause_between_looks);
  if (!next_look_->armed() || when < next_look_->armed()) {
    next_look_->set(when);
  }
}

void DiscoveredRoutes::stop() {
  stopped_ = true;
  next_look_->cancel();
}

void DiscoveredRoutes::update() {
  if (stopped_ || !own_) {
    return;
  }
  if (locking_) {
    missed_ = true;
    return;
  }
  last_ = context_.clock.now();
  const std::map<TopicAndType, Found> found = look();
  drop_what_is_gone(found);
  std::vector<Candidate> candidates;
  for (const auto& [what, how] : found) {
    consider(what, how, candidates);
  }
  lock(candidates);
  for (const Candidate& candidate : candidates) {
    make(candidate);
  }
  for (auto& [topic, live] : live_) {
    if (const auto how = found.find({topic, live.route.type}); how != found.end()) {
      live.running->follow(how->second.offers);
    }
  }
  routes_.update_offers();
  if (watcher_.looked) {
    watcher_.looked();
  }
}

std::map<DiscoveredRoutes::TopicAndType, DiscoveredRoutes::Found> DiscoveredRoutes::look() {
  for (Pattern& pattern : patterns_) {
    pattern.topics = 0;
    pattern.brought = false;
  }
  std::map<TopicAndType, Found> found;
  std::map<std::string, Pattern*> owners;
  for (const dds::FoundWriter& writer : context_.dds->writers()) {
    const auto topic = dds::topic_of_ros(writer.topic);
    if (!topic || !messages::is_topic_name(*topic) || own_topics_.contains(*topic)) {
      continue;
    }
    const auto [owner, is_new] = owners.try_emplace(*topic, nullptr);
    if (const auto known = owners_.find(*topic); is_new && known != owners_.end()) {
      owner->second = known->second;
    } else if (is_new) {
      owner->second = owner_of(*topic);
    }
    if (owner->second == nullptr) {
      continue;
    }
    if (writer.bridge &&
        !goes_on(mark_of(config_.someip.address, owner->second->settings->route), writer.bridge_text)) {
      owner->second->brought = true;
      continue;
    }
    Found& one = found[{*topic, dds::type_of_ros(writer.type).value_or(writer.type)}];
    one.pattern = owner->second;
    if (!writer.refused) {
      one.offers.add(writer.qos);
    }
  }
  owners_ = std::move(owners);
  const std::string* last = nullptr;
  for (const auto& [what, one] : found) {
    one.pattern->topics += last == nullptr || *last != what.first ? 1U : 0U;
    last = &what.first;
  }
  return found;
}

void DiscoveredRoutes::drop_what_is_gone(const std::map<TopicAndType, Found>& found) {
  for (auto live = live_.begin(); live != live_.end();) {
    const auto next = std::next(live);
    if (!found.contains({live->first, live->second.route.type})) {
      spdlog::info("nobody publishes {} any more: {} is withdrawn", live->first,
                   in_words(live->second.route));
      drop(live);
    }
    live = next;
  }
  std::erase_if(refused_, [&](const auto& one) { return !found.contains(one.first); });
}

void DiscoveredRoutes::drop(std::map<std::string, Live>::iterator live) {
  if (watcher_.ends) {
    watcher_.ends(live->first);
  }
  add(past_, live->second.running->counters());
  routes_.remove(live->second.route, *live->second.running);
  live_.erase(live);
}

void DiscoveredRoutes::consider(const TopicAndType& what, const Found& found,
                                std::vector<Candidate>& candidates) {
  const auto& [topic, type] = what;
  Pattern& pattern = *found.pattern;
  Route route = pattern.settings->route;
  route.topic = topic;
  route.type = type;
  route.qos = followed(route.qos, found.offers);
  if (const auto live = live_.find(topic); live != live_.end() && live->second.route.type == type) {
    return;
  }
  if (const auto known = refused_.find(what);
      known != refused_.end() &&
      (known->second == Refusal::unknown_type || known->second == Refusal::not_opened)) {
    return;
  }
  const LockedTopic* const locked = lock_.find(topic);
  const std::string* const other = locked != nullptr ? &locked->type
                                   : !candidates.empty() && candidates.back().route.topic == topic
                                       ? &candidates.back().route.type
                                       : nullptr;
  if (other != nullptr && *other != type) {
    refuse(
        what, pattern, Refusal::other_type,
        fmt::format("{} has its id in {} for the type {}, but a publisher has {}: if that is its type from "
                    "now on, remove its line there and send SIGHUP",
                    topic, lock_.file(), *other, documents::printable(type)));
    return;
  }
  if (locked == nullptr && pattern.locked >= pattern.settings->max_routes) {
    refuse(what, pattern, Refusal::too_many,
           fmt::format("{} gets no route: {} topics of {} have an id already (max_routes)", topic,
                       pattern.locked, pattern.settings->topics));
    return;
  }
  const std::optional<someip::ServiceId> id = !has_known_type(route, pattern) ? std::nullopt
                                              : locked != nullptr             ? std::optional{locked->service}
                                                                              : new_id(what, pattern);
  if (id) {
    route.service = *id;
    candidates.push_back({&pattern, std::move(route), locked == nullptr});
  }
}

bool DiscoveredRoutes::has_known_type(const Route& route, Pattern& pattern) {
  const TopicAndType what{route.topic, route.type};
  if (!messages::is_type_name(route.type)) {  // which would be looked for among files
    refuse(what, pattern, Refusal::unknown_type,
           fmt::format("{} gets no route: {} is no message type of ROS", route.topic,
                       documents::quote(route.type)));
    return false;
  }
  try {
    static_cast<void>(compile(route, types_));
    return true;
  } catch (const std::exception& error) {
    refuse(what, pattern, Refusal::unknown_type, error.what());
    return false;
  }
}

std::optional<someip::ServiceId> DiscoveredRoutes::new_id(const TopicAndType& what, Pattern& pattern) {
  const ServiceRange range = pattern.settings->services;
  // What another bridge has chosen for another topic is left to it. Our own lock file says nothing of that.
  const auto id = choose_service(range, what.first, what.second, [&](someip::ServiceId one) {
    return taken_.contains(one) || context_.someip->is_offered_by_others(one);
  });
  if (!id) {
    refuse(what, pattern, Refusal::no_id,
           fmt::format(
               "{} gets no route: all ids of 0x{:04x}-0x{:04x} are taken (services), or offered by others",
               what.first, someip::value(range.first), someip::value(range.last)));
    return std::nullopt;
  }
  taken_.insert(*id);
  ++pattern.locked;
  return id;
}

void DiscoveredRoutes::lock(std::vector<Candidate>& candidates) {
  std::vector<LockedTopic> more;
  for (Candidate& one : candidates) {
    if (one.is_new) {
      more.push_back({one.route.topic, one.route.type, one.route.service, one.route.qos.transient_local});
      being_locked_.push_back(std::move(one));
    }
  }
  std::erase_if(candidates, [](const Candidate& one) { return one.is_new; });
  if (more.empty()) {
    return;
  }
  locking_ = true;
  boost::asio::post(disk_, [this, &io = context_.io, alive = std::weak_ptr{alive_}, file = lock_,
                            more = std::move(more)]() mutable {
    auto written = file.add(more);
    boost::asio::post(io, [this, alive, file = std::move(file), written = std::move(written)]() mutable {
      if (!alive.expired()) {
        locked(std::move(file), written);
      }
    });
  });
}

void DiscoveredRoutes::locked(LockFile file, const tl::expected<void, std::string>& written) {
  locking_ = false;
  std::vector<Candidate> candidates = std::exchange(being_locked_, {});
  if (stopped_) {
    return;
  }
  if (written) {
    missed_ = false;
    lock_ = std::move(file);
    for (const Candidate& one : candidates) {
      make(one);
    }
    update();  // some may be gone already
    return;
  }
  // What has no place there would have another id one day.
  for (const Candidate& one : candidates) {
    taken_.erase(one.route.service);
    --one.pattern->locked;
    refuse({one.route.topic, one.route.type}, *one.pattern, Refusal::not_locked,
           "discovered topics get no routes: " + written.error());
  }
  if (std::exchange(missed_, false)) {
    changed();
  } else if (!next_look_->armed()) {
    next_look_->set(last_ + pause_before_locking_again);
  }
}

void DiscoveredRoutes::make(const Candidate& candidate) {
  const Route& route = candidate.route;
  try {
    BridgeConfig alone;
    alone.routes = {route};
    std::shared_ptr<RunningRoute> made = std::move(make_routes(*own_, alone, types_).front().route);
    RunningRoute& running = *made;
    routes_.add(route, std::move(made), *context_.someip);
    spdlog::info("discovered {} ({}): {}, event 0x{:04x}", route.topic, route.type, in_words(route),
                 someip::value(route.event));
    ++candidate.pattern->made;
    refused_.erase({route.topic, route.type});
    live_.emplace(route.topic, Live{candidate.pattern, route, &running});
    if (watcher_.made) {
      watcher_.made(running);
    }
  } catch (const std::exception& error) {
    refuse({route.topic, route.type}, *candidate.pattern, Refusal::not_opened,
           fmt::format("{} gets no route: {}", route.topic, error.what()));
  }
}

void DiscoveredRoutes::refuse(const TopicAndType& what, Pattern& pattern, Refusal why,
                              const std::string& told) {
  const auto [known, is_new] = refused_.try_emplace(what, why);
  if (!is_new && std::exchange(known->second, why) == why) {
    return;
  }
  ++pattern.refused.at(static_cast<std::size_t>(why));
  // One type that is not known may be that of many topics.
  const std::string& key = why == Refusal::unknown_type ? what.second : told;
  if (told_.size() < told_max && told_.insert(key).second) {
    spdlog::warn("{}:{}:{}: {}{}", config_.file, pattern.settings->mark.line, pattern.settings->mark.column,
                 told, told_.size() == told_max ? " (more such lines are not logged)" : "");
  }
}

RoutePicture DiscoveredRoutes::picture_of_pattern(const Pattern& pattern) const {
  const TopicPattern& settings = *pattern.settings;
  RoutePicture result = picture_of(settings);
  result.pattern.routes = static_cast<std::uint32_t>(routes_of(pattern));
  result.pattern.topics = static_cast<std::uint32_t>(pattern.topics);
  result.pattern.brought = pattern.brought;
  result.pattern.lock_file = config_.lock_file;
  if (settings.route.direction == Direction::dds_to_someip) {
    result.in_use = static_cast<std::uint32_t>(pattern.locked);
    result.limit = static_cast<std::uint32_t>(settings.max_routes);
  } else {
    result.pattern.locked = std::ranges::any_of(config_.locked, [&](const LockedTopic& locked) {
      return pattern_of(config_.patterns, locked.topic) == &settings;
    });
  }
  return result;
}

void DiscoveredRoutes::append_pictures(std::vector<RoutePicture>& pictures) const {
  for (const Pattern& pattern : patterns_) {
    pictures.push_back(picture_of_pattern(pattern));
    pictures.back().counters = pictures_of(counters_of(pattern).counters);
  }
}

void DiscoveredRoutes::append_silence(SilenceWatch& silence) {
  for (const Pattern& pattern : patterns_) {
    silence.add({.topic = "pattern " + pattern.settings->topics,
                 .received = [&pattern] { return pattern.made; },
                 .picture = [this, &pattern] { return picture_of_pattern(pattern); }});
  }
}

void DiscoveredRoutes::append_diagnoses(std::vector<Diagnosis>& diagnoses) const {
  for (const Pattern& pattern : patterns_) {
    const TopicPattern& settings = *pattern.settings;
    if (settings.route.direction == Direction::dds_to_someip) {
      diagnoses.push_back(method_state(
          counters_of(pattern), routes_of(pattern) > 0,
          pattern.topics > 0 ? "no topic that matches gets a route" : "nobody publishes a topic that matches",
          fmt::format("0x{:04x}-0x{:04x}", value(settings.services.first), value(settings.services.last))));
    }
  }
}

std::size_t DiscoveredRoutes::routes_of(const Pattern& pattern) const {
  return static_cast<std::size_t>(
      std::ranges::count_if(live_, [&](const auto& one) { return one.second.pattern == &pattern; }));
}

CounterGroup DiscoveredRoutes::counters_of(const Pattern& pattern) const {
  constexpr std::array names{"unknown_type", "other_type", "too_many", "no_id", "not_locked", "not_opened"};
  static_assert(names.size() == refusals);
  CounterGroup group{"pattern " + pattern.settings->topics,
                     {{"topics", pattern.topics},
                      {"routes", routes_of(pattern)},
                      {"routes_made", pattern.made},
                      {"locked", pattern.locked}},
                     {{"pattern", pattern.settings->topics}}};
  for (std::size_t i = 0; i < refusals; ++i) {
    group.counters.push_back({names.at(i), pattern.refused.at(i), Counter::Kind::loss});
  }
  return group;
}

void DiscoveredRoutes::append_counters(std::vector<CounterGroup>& groups) const {
  using enum someip::CounterKind;
  if (!past_.counters.empty()) {
    groups.push_back(past_);
  }
  for (const Pattern& pattern : patterns_) {
    if (pattern.settings->route.direction == Direction::dds_to_someip) {
      groups.push_back(counters_of(pattern));
    }
  }
  groups.push_back({"DDS discovery", {{"not_remembered", context_.dds->not_remembered(), loss}}});
}

}  // namespace trestle::carry
