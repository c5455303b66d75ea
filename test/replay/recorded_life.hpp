#pragma once
#include <map>
#include <optional>
#include <tuple>
#include <vector>

#include "sd/core/storage.hpp"
#include "sd/wire/message.hpp"
#include "test/replay/recording.hpp"
#include "test/replay/sd_replay.hpp"

namespace trestle::test {

inline constexpr std::uint16_t sd_port = 30490;
/// Our initial wait, where the recording does not tell another.
inline constexpr Duration usual_wait = std::chrono::milliseconds{10};

using ServiceKey = std::tuple<sd::ServiceId, sd::InstanceId, std::uint8_t>;
using GroupKey = std::pair<ServiceKey, sd::EventgroupId>;

inline ServiceKey key_of(const sd::Entry& entry) {
  return {entry.service, entry.instance, entry.major};
}

struct Period {
  Duration from{};
  std::optional<Duration> to;
};

struct OfferWish {
  std::uint32_t minor = 0;
  std::optional<Endpoint> udp;
  std::optional<Endpoint> tcp;
  std::vector<Period> periods;
  std::map<sd::EventgroupId, sd::Eventgroup> eventgroups;
};

struct SubscriptionWish {
  std::optional<Endpoint> udp;
  std::optional<Endpoint> tcp;
  std::vector<Period> periods;
};

/// What the application of one life of a process wanted.
struct Wishes {
  std::map<ServiceKey, OfferWish> offers;
  std::map<ServiceKey, Period> needs;
  std::map<GroupKey, SubscriptionWish> subscriptions;
  std::optional<Duration> first_multicast_offer;
  bool offered_before = false;  // the recording begins in the middle of the process's life
  std::uint32_t ttl_s = 3;
  Endpoint group;
  Duration from{};
  Duration to{};
};

using Datagrams = std::vector<const RecordedBytes*>;

/// A datagram's SD message and what holds it.
struct SdDatagram {
  explicit SdDatagram(ByteView bytes) {
    const auto message = someip::decode(bytes);
    if (message) {
      header = message->header;
      sd = sd::decode(*message);
    }
  }
  [[nodiscard]] bool good() const { return sd.has_value(); }

  someip::Header header;
  tl::expected<sd::SdMessage, sd::WireFault> sd = tl::unexpected{sd::WireFault{}};
};

struct Endpoints {
  std::optional<Endpoint> udp;
  std::optional<Endpoint> tcp;
  std::optional<Endpoint> multicast;
};

/// The endpoints that an entry names.
Endpoints endpoints_of(const sd::SdMessage& message, const sd::Entry& entry);

/// The lives of the process at `who`: another one begins when the sessions of a receiver begin anew.
std::vector<Datagrams> lives_of(const Recording& recording, const IpAddress& who);

/// Reads off a life what its application wanted.
Wishes wishes_of(const Recording& recording, const IpAddress& who, const Datagrams& life,
                 const ReplayTiming& timing);

}  // namespace trestle::test
