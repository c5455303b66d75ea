#pragma once
#include <cstddef>

#include "bridge/carry/config/bridge_config.hpp"
#include "dds_adapter/participant.hpp"

namespace trestle::carry {

/// The least that the publishers of a topic offer: a reader that asks for no more gets the samples of all of
/// them.
struct PublishedQos {
  bool reliable = true;
  bool transient_local = true;
  std::size_t publishers = 0;

  void add(const dds::Qos& publisher) noexcept {
    reliable &= publisher.reliable;
    transient_local &= publisher.transient_local;
    ++publishers;
  }
};

/// Whether the reader of a route is to ask for what is published.
[[nodiscard]] inline bool is_as_published(const QosSettings& settings) noexcept {
  return settings.reliability_as_published || settings.durability_as_published;
}

/// What the reader of a route is to ask for, now that this is published. While nobody publishes it is what
/// stands in `settings`.
[[nodiscard]] inline QosSettings followed(QosSettings settings, const PublishedQos& published) noexcept {
  if (published.publishers > 0) {
    if (settings.reliability_as_published) {
      settings.reliable = published.reliable;
    }
    if (settings.durability_as_published) {
      settings.transient_local = published.transient_local && settings.reliable;
    }
  }
  return settings;
}

}  // namespace trestle::carry
