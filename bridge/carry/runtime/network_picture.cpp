#include "bridge/carry/runtime/network_picture.hpp"

#include <sys/resource.h>

#include <filesystem>
#include <iterator>
#include <system_error>
#include <utility>

#include "bridge/carry/runtime/node_counters.hpp"
#include "bridge/carry/runtime/surroundings.hpp"
#include "dds_adapter/participant.hpp"
#include "sd/net/node.hpp"
#include "someip/net/address_text.hpp"

namespace trestle::carry {
namespace {

/// Of the process.
LimitPicture descriptors() {
  rlimit limit{};
  std::error_code error;
  const std::filesystem::directory_iterator all{"/proc/self/fd", error};
  const std::ptrdiff_t used = error ? 0 : std::distance(begin(all), end(all));
  return {.name = "descriptors",
          .used = static_cast<std::uint64_t>(used),
          .limit = ::getrlimit(RLIMIT_NOFILE, &limit) == 0 ? std::uint64_t{limit.rlim_cur} : 0};
}

}  // namespace

void append_networks(Picture& picture, const sd::Node& node, const dds::Participant& participant) {
  SomeipPicture& someip = picture.someip;
  for (const sd::SeenHost& one : node.hosts()) {
    if (someip.hosts.size() < most_listed) {
      someip.hosts.push_back({.address = someip::to_string(one.at.address),
                              .port = one.at.port,
                              .seen_s = std::chrono::duration<double>{one.silent}.count(),
                              .offers = static_cast<std::uint32_t>(one.offers),
                              .subscribed = static_cast<std::uint32_t>(one.subscriptions)});
    }
  }
  for (const sd::SeenOffer& one : node.seen_offers()) {
    if (someip.offers.size() < most_listed) {
      someip.offers.push_back(picture_of(one));
    }
  }
  DdsPicture& dds = picture.dds;
  for (dds::FoundParticipant& one : participant.participants()) {
    if (dds.participants.size() < most_listed) {
      dds.participants.push_back(
          {.name = std::move(one.name), .guid = std::move(one.guid), .addresses = std::move(one.addresses)});
    }
  }
  dds.writers = static_cast<std::uint32_t>(participant.writers().size());
  dds.not_remembered = participant.not_remembered();

  std::vector<CounterGroup> groups;
  append_counters(groups, counts_of(node));
  for (CounterGroup& one : groups) {
    picture.counters.push_back({std::move(one.name), pictures_of(one.counters)});
  }
  for (const sd::UsedLimit& one : node.used_limits()) {
    picture.limits.push_back({one.name, one.used, one.limit});
  }
  picture.limits.push_back(descriptors());
}

}  // namespace trestle::carry
