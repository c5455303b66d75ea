#include "bridge/runtime/silence_watch.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <utility>

namespace trestle::bridge {
namespace {

constexpr std::size_t most_topics = 3;

}  // namespace

void SilenceWatch::arm() {
  if (!started_ || armed_ || routes_.empty()) {
    return;
  }
  armed_ = true;
  timer_.expires_after(period);
  timer_.async_wait([this](const boost::system::error_code& cancelled) {
    if (!cancelled) {  // else this object may be gone
      armed_ = false;
      look();
      arm();
    }
  });
}

void SilenceWatch::remove(const std::string& topic) {
  std::erase_if(routes_, [&](const Watched& one) { return one.topic == topic; });
}

void SilenceWatch::look() {
  std::erase_if(routes_, [](const Watched& one) { return !one.silent(); });
  if (routes_.empty()) {
    return;
  }
  using Kind = SilenceReason::Kind;
  const Heard heard = prepare_();
  std::map<Kind, std::vector<const Watched*>> changed;
  std::size_t lines = 0;
  for (Watched& one : routes_) {
    if (std::exchange(one.is_new, false)) {
      continue;
    }
    SilenceReason reason = one.reason();
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
    const std::size_t hosts = kind >= Kind::no_participant ? heard.dds : heard.someip;
    if (lines <= most_lines) {
      for (const Watched* const one : routes) {
        tell_(fmt::format("{}: nothing has come yet: {}", one->topic, in_words(one->told, 1, hosts)));
      }
      continue;
    }
    std::vector<std::string> topics;
    for (const Watched* const one : routes) {
      if (topics.size() < most_topics) {
        topics.push_back(one->topic);
      }
    }
    tell_(fmt::format("{}{}: nothing has come yet: {}", fmt::join(topics, ", "),
                      routes.size() > topics.size()
                          ? fmt::format(" and {} more routes", routes.size() - topics.size())
                          : "",
                      in_words(routes.front()->told, routes.size(), hosts)));
  }
}

}  // namespace trestle::bridge
