#include "bridge/carry/runtime/silence_watch.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <optional>
#include <string_view>
#include <utility>

namespace trestle::carry {
namespace {

constexpr std::size_t most_topics = 3;

// Nothing is amiss with a route that has worked: there is nothing to send.
bool somebody_may_send(SilenceReason::Kind kind) {
  using Kind = SilenceReason::Kind;
  return kind == Kind::other_events || kind == Kind::no_event || kind == Kind::no_sample;
}

std::string_view silence_of(const SilenceWatch::Watched& route) {
  return route.before > 0 ? "nothing comes any longer" : "nothing has come yet";
}

}  // namespace

void SilenceWatch::arm() {
  if (started_ && !next_look_->armed() && !routes_.empty()) {
    next_look_->set(clock_.now() + period);
  }
}

void SilenceWatch::remove(const std::string& topic) {
  std::erase_if(routes_, [&](const Watched& one) { return one.topic == topic; });
}

void SilenceWatch::look() {
  using Kind = SilenceReason::Kind;
  std::optional<Heard> heard;
  std::map<Kind, std::vector<const Watched*>> changed;
  std::size_t lines = 0;
  for (Watched& one : routes_) {
    const std::uint64_t received = one.received();
    if (received != std::exchange(one.before, received)) {
      one.told = {};
      one.is_new = false;
      continue;
    }
    if (std::exchange(one.is_new, false)) {
      continue;
    }
    if (!heard) {
      heard = prepare_();
    }
    SilenceReason reason = one.reason();
    if (received > 0 && somebody_may_send(reason.kind)) {
      reason = {};
    }
    if (reason == one.told) {
      continue;
    }
    one.told = std::move(reason);
    if (one.told.kind != Kind::none) {
      changed[one.told.kind].push_back(&one);
      ++lines;
    }
  }
  for (const auto& [kind, routes] : changed) {
    const std::size_t hosts = kind >= Kind::no_participant ? heard->dds : heard->someip;
    if (lines <= most_lines) {
      for (const Watched* const one : routes) {
        tell_(fmt::format("{}: {}: {}", one->topic, silence_of(*one), in_words(one->told, 1, hosts)));
      }
      continue;
    }
    std::vector<std::string> topics;
    for (const Watched* const one : routes) {
      if (topics.size() < most_topics) {
        topics.push_back(one->topic);
      }
    }
    tell_(fmt::format("{}{}: {}: {}", fmt::join(topics, ", "),
                      routes.size() > topics.size()
                          ? fmt::format(" and {} more routes", routes.size() - topics.size())
                          : "",
                      silence_of(*routes.front()), in_words(routes.front()->told, routes.size(), hosts)));
  }
}

}  // namespace trestle::carry
