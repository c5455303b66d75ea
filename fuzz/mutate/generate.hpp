#pragma once
#include <cstdint>
#include <map>
#include <vector>

#include "fuzz/mutate/mutate.hpp"
#include "fuzz/mutate/typed.hpp"
#include "someip/wire/endpoint.hpp"

namespace trestle::fuzz {

/// What is known of a service that messages are made for. Ids as in the SOME/IP header and in entries.
struct KnownService {
  std::uint16_t service = 0;                 ///< Service ID
  std::uint16_t instance = 1;                ///< Instance ID
  std::uint8_t major = 1;                    ///< its version, which is also the Interface Version of requests
  std::uint32_t minor = 0;                   ///< its version
  std::vector<std::uint16_t> methods{};      ///< of requests; may be empty
  std::vector<std::uint16_t> eventgroups{};  ///< may be empty
  std::vector<std::uint16_t> events{};       ///< may be empty
  /// What is known of the payloads of requests and events, by method or event id. Those of others are any
  /// bytes.
  std::map<std::uint16_t, Shape> payloads{};
};

/// A request, or a request without an answer, with a payload of up to `max_payload` bytes: mostly of a method
/// that the service has, and then mostly of that method's type, where it is known.
[[nodiscard]] Bytes make_request(const KnownService& service, std::size_t max_payload, Random& random);

/// Requests in each of which one thing is wrong in the payload, each that can be once: make_spoilt_payloads()
/// for each method whose type is known.
[[nodiscard]] std::vector<Bytes> make_spoilt_requests(const KnownService& service, std::size_t max_payload,
                                                      Random& random);

/// An event, likewise. Ids of events begin at 0x8000.
[[nodiscard]] Bytes make_notification(const KnownService& service, std::size_t max_payload, Random& random);

/// Changes one thing in the payload of a request or event of the service, by its type.
/// @param max_size  `message` is not longer than this afterwards, in bytes.
/// @return false: it is none of them, or its type is not known. It stays as it is.
bool mutate_typed(Bytes& message, const KnownService& service, std::size_t max_size, Random& random);

/// A message of service discovery with one entry or a few: FindService, OfferService, SubscribeEventgroup,
/// their Stop variants, and answers. Entries are right in themselves; mutate() makes them wrong.
/// @param own  the endpoint over UDP or TCP that subscriptions and offers name.
[[nodiscard]] Bytes make_discovery(const KnownService& service, const Endpoint& own, Random& random);

/// SubscribeEventgroup over UDP for one eventgroup.
/// @param ttl_s  lifetime in seconds; 0: StopSubscribeEventgroup.
[[nodiscard]] Bytes make_subscribe(const KnownService& service, std::uint16_t eventgroup, std::uint32_t ttl_s,
                                   const Endpoint& own);

/// OfferService, over UDP and TCP.
/// @param ttl_s  lifetime in seconds; 0: StopOfferService.
[[nodiscard]] Bytes make_offer(const KnownService& service, std::uint32_t ttl_s, const Endpoint& own);

/// The request in SOME/IP-TP segments of up to `segment` bytes of payload each; those that are not whole
/// multiples of 16 are cut down. A request that fits comes back as it is.
[[nodiscard]] std::vector<Bytes> make_segments(const Bytes& request, std::size_t segment);

}  // namespace trestle::fuzz
