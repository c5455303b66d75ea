#include "bridge/carry/runtime/silence_watch.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <string_view>
#include <utility>

namespace trestle::carry {
namespace {

constexpr std::size_t most_topics = 3;

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
  struct Silent {
    const Watched* watched;
    RoutePicture picture;
  };
  const Picture* around = nullptr;
  std::map<Cause, std::vector<Silent>> changed;
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
    if (around == nullptr) {
      around = &prepare_();
    }
    RoutePicture picture = one.picture();
    Why found = why(picture, *around);
    if (found == one.told) {
      continue;
    }
    one.told = std::move(found);
    if (one.told.cause != Cause::none) {
      changed[one.told.cause].push_back({&one, std::move(picture)});
      ++lines;
    }
  }
  for (const auto& [cause, routes] : changed) {
    if (lines <= most_lines) {
      for (const Silent& one : routes) {
        tell_(fmt::format("{}: {}: {}", one.watched->topic, silence_of(*one.watched),
                          in_words(one.watched->told, &one.picture, *around)));
      }
      continue;
    }
    std::vector<std::string> topics;
    for (const Silent& one : routes) {
      if (topics.size() < most_topics) {
        topics.push_back(one.watched->topic);
      }
    }
    const Silent& first = routes.front();
    tell_(fmt::format("{}{}: {}: {}", fmt::join(topics, ", "),
                      routes.size() > topics.size()
                          ? fmt::format(" and {} more routes", routes.size() - topics.size())
                          : "",
                      silence_of(*first.watched),
                      in_words(first.watched->told, routes.size() == 1 ? &first.picture : nullptr, *around)));
  }
}

}  // namespace trestle::carry
