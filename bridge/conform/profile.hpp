#pragma once
#include <cstdint>
#include <optional>
#include <string>
#include <tl/expected.hpp>
#include <vector>

#include "bridge/conform/protection.hpp"
#include "bridge/documents/problem.hpp"
#include "someip/wire/endpoint.hpp"

/// What is known of the device before anything is sent to it.
namespace trestle::conform {

struct EventgroupProfile {
  someip::EventgroupId id{};
  std::vector<someip::MethodId> events{};
  std::optional<Endpoint> multicast{};  ///< where its events go to when it is a multicast eventgroup
  std::size_t multicast_threshold = 1;  ///< so many subscribers at least; else they get events by unicast
  std::optional<someip::MethodId> trigger{};  ///< a method without return that makes it send its events
  std::optional<Duration> cycle{};            ///< it sends its first event by itself, so often
  bool initial_values = false;                ///< it has fields, so that subscribers get their values
  bool tcp = false;                           ///< it has events that need TCP
};

/// A method that any device may have: a request that is answered without an error.
struct RequestProfile {
  someip::MethodId method{};
  std::vector<std::byte> payload{};
};

struct FieldProfile {
  someip::MethodId getter{};
  someip::MethodId setter{};
  std::vector<std::byte> value{};  ///< that may be set
  someip::EventgroupId eventgroup{};
};

/// What is large at a service without the Enhanced Testability Service, so that it goes in segments
/// (SOME/IP-TP).
struct LargeProfile {
  std::optional<someip::MethodId> echo{};     ///< answers with the payload that it gets
  std::optional<someip::MethodId> request{};  ///< takes any array of bytes, and answers without an error
  std::optional<RequestProfile> response{};   ///< has a large answer
  std::optional<someip::MethodId>
      event{};  ///< of an eventgroup with a trigger, or the first of one with a cycle
};

/// What an offer says of its place among the instances of a service.
struct LoadBalancingProfile {
  std::uint16_t priority = 0;
  std::uint16_t weight = 0;
};

struct ServiceProfile {
  someip::ServiceId service{};
  someip::InstanceId instance{};
  std::uint8_t major = 1;
  std::uint32_t minor = 0;
  std::optional<std::uint32_t> ttl_s{};
  std::optional<std::uint16_t> udp_port{};
  std::optional<std::uint16_t> tcp_port{};
  std::vector<EventgroupProfile> eventgroups{};
  std::optional<RequestProfile> request{};
  std::optional<someip::MethodId> fire_and_forget{};
  std::optional<FieldProfile> field{};
  std::optional<LoadBalancingProfile> load_balancing{};  ///< of its offers
  std::vector<std::string> configuration{};              ///< of its offers: "key", "key=" or "key=value"
  LargeProfile large{};
  /// Methods that answer with the payload that they get, and events.
  std::vector<E2eProtection> e2e{};
};

/// An eventgroup that the device subscribes to, and an event of it.
struct WantedEventgroup {
  someip::EventgroupId id{};
  someip::MethodId event{};
};

/// A service that the device uses, which the tester offers.
struct UsedService {
  someip::ServiceId service{};
  someip::InstanceId instance{1};
  std::uint8_t major = 1;
  /// The Enhanced Testability Service says when; else the device uses it by itself, from its start.
  bool by_ets = false;
  std::optional<WantedEventgroup> udp{};
  std::optional<WantedEventgroup> tcp{};
  std::optional<WantedEventgroup> multicast{};
};

/// When the device sends by itself, as it is configured; nothing: not known.
struct TimingProfile {
  std::optional<Duration> initial_delay_max{};
  std::optional<Duration> repetitions_base_delay{};
  std::optional<std::uint8_t> repetitions_max{};
  std::optional<Duration> cyclic_offer_delay{};
  Duration answer_within = std::chrono::seconds{1};  ///< for whatever is asked for
  Duration ready_within = std::chrono::seconds{10};  ///< from its start to the first offer
};

/// How errors are told.
enum class ErrorType : std::uint8_t { response, error, either };

/// What the device is meant to do where editions of the specification and TC8 differ.
struct PolicyProfile {
  /// The flag 0x20 of SD messages is known, which TC8 v3.0 takes for a reserved bit.
  bool explicit_initial_data = true;
  /// Finds are answered by multicast where TC8 wants that; else by unicast always.
  bool multicast_find_answers = false;
  /// Answers go where the SD endpoint option of a message says, which older editions do not know.
  bool sd_endpoint_option = true;
  bool answers_unknown_service = true;  ///< with an error; the specification leaves that open
  bool answers_unknown_method = true;   ///< likewise
  /// A request that has a return code is answered as if it had none, as TC8 wants it; else it is dropped.
  bool processes_request_with_return_code = true;
  ErrorType error_type = ErrorType::either;
  /// Subscriptions to what is not there are refused with a Nack; else they may be ignored.
  bool refuses_unknown_subscriptions = true;
};

/// How the device is started and stopped: commands of a shell. None of them: it runs already, and cases that
/// need a restart are reported as unsupported.
struct LifecycleProfile {
  std::string start{};  ///< runs as long as the device does
  std::string stop{};   ///< none: SIGTERM ends what `start` began
  std::string restart{};
  bool ask_operator = false;  ///< a person does it, and says when it is done
};

/// An event that can be waited for, over UDP: the device sends it when it is told to, or by itself.
struct EventSource {
  someip::EventgroupId group{};
  someip::MethodId event{};
  std::optional<someip::MethodId> trigger{};  ///< a method without return
  Duration cycle{0};                          ///< without a trigger
};

/// The faults that a device can be started with, for `trestle conform selftest`.
struct FaultsProfile {
  std::string
      list{};  ///< prints a line for each: its name, a tab, which cases may find it, a tab, what it is
  std::string start{};  ///< as LifecycleProfile::start, with {fault} for the name
};

struct Profile {
  std::string file{};
  std::string name{};
  std::string version{};
  IpAddress device{};
  IpAddress tester{};
  IpAddress multicast = IpAddress::v4(224, 244, 224, 245);
  std::uint16_t sd_port = 30490;
  /// The first one is what most cases talk to. None: the device is a client alone.
  std::vector<ServiceProfile> services{};
  std::vector<UsedService> uses{};
  bool ets = false;  ///< the first service has the interface of the Enhanced Testability Service
  bool tp = false;   ///< its array echo (0x09) takes requests in segments, and answers so
  TimingProfile timing{};
  PolicyProfile policy{};
  LifecycleProfile lifecycle{};
  FaultsProfile faults{};

  /// The first one; of a device without services: none at all.
  [[nodiscard]] const ServiceProfile& service() const;
  /// The first service that the device uses by itself: a device without services has one.
  [[nodiscard]] const UsedService& used_by_itself() const;
  [[nodiscard]] bool can_restart() const {
    return !lifecycle.start.empty() || !lifecycle.restart.empty() || lifecycle.ask_operator;
  }
};

/// The same instance in another major version; nothing: there is none.
[[nodiscard]] const ServiceProfile* other_version(const Profile& profile, const ServiceProfile& service);

/// One of the first service; nothing: the profile tells of none.
[[nodiscard]] std::optional<EventSource> event_source(const Profile& profile);

/// How this event of a service can be waited for: it comes by unicast over UDP. Nothing: it cannot.
[[nodiscard]] std::optional<EventSource> event_source(const ServiceProfile& service, someip::MethodId event);

/// One of the first service over TCP. A trigger is called over UDP.
[[nodiscard]] std::optional<EventSource> tcp_event_source(const Profile& profile);
/// The same of any service.
[[nodiscard]] std::optional<EventSource> tcp_event_source(const ServiceProfile& service);

/// A method of the first service that takes requests in segments.
struct LargeRequest {
  someip::MethodId method{};
  bool is_echo = false;  ///< it answers with the payload that it gets
};

/// Nothing: the profile tells of none.
[[nodiscard]] std::optional<LargeRequest> large_request(const Profile& profile);
/// An event of the first service that comes in segments; nothing: the profile tells of none.
[[nodiscard]] std::optional<EventSource> large_event(const Profile& profile);

/// Whether a profile names services that the device offers or uses.
enum class ProfileServices : std::uint8_t { needed, optional };

/// Reads a profile.
/// @param file  its name, for messages.
/// @return the profile, or what is wrong with it, each with line and column.
[[nodiscard]] tl::expected<Profile, std::vector<documents::Problem>> read_profile(
    const std::string& text, const std::string& file, ProfileServices services = ProfileServices::needed);

/// `command` with {device}, {tester}, {multicast}, {event_multicast} (of the first eventgroup that has one),
/// {sd_port}, {programs} (the folder of the running program) and {fault} replaced.
[[nodiscard]] std::string filled_in(const std::string& command, const Profile& profile,
                                    const std::string& programs, const std::string& fault = {});

}  // namespace trestle::conform
