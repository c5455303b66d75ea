#pragma once
#include <cstdint>
#include <functional>
#include <map>
#include <set>
#include <string>
#include <tuple>

#include "bridge/describe/model.hpp"
#include "bridge/traffic/message_sink.hpp"
#include "bridge/traffic/network_view.hpp"
#include "bridge/traffic/tp_assembly.hpp"

namespace trestle::generate {

/// What traffic tells of a system's interfaces: ids, versions, endpoints, eventgroups, and how large payloads
/// are. It does not tell names or types, so members are called "method_0001" and "event_8001". Feed it
/// through an traffic::CaptureReader.
class CaptureModel : public traffic::MessageSink {
 public:
  using Announced = std::function<void(Transport, const Endpoint&)>;

  /// @param announced  told of each endpoint that service discovery names; may be empty.
  explicit CaptureModel(Announced announced = {}) : announced_{std::move(announced)} {}

  using MessageSink::undecodable;
  bool message(const traffic::Place& place, std::size_t offset, const someip::Message& message) override;
  void undecodable(const traffic::Place& place, std::size_t offset, ByteView bytes,
                   const traffic::Violation& violation) override;
  void broken_frame(const traffic::Place& place, const traffic::Violation& violation) override;

  /// What came to service discovery, where nothing else can be seen.
  void sd_datagram(ByteView datagram, const Endpoint& from, const Endpoint& to, TimePoint now);

  /// All that was seen until now.
  ///
  /// Of a method and an event of one id, which no interface has, the one with more messages is there, and a
  /// warning tells of the other one.
  /// @param file  the name of the capture, for Model::files.
  [[nodiscard]] describe::Reading reading(const std::string& file) const;

  [[nodiscard]] std::uint64_t messages() const noexcept { return messages_; }
  /// What was no message, and messages of services or members beyond the limits.
  [[nodiscard]] std::uint64_t passed_over() const noexcept { return passed_over_; }

 private:
  static constexpr std::size_t max_services = 10'000;
  static constexpr std::size_t max_members = 20'000;
  /// Of an event: more receivers tell no more of its eventgroups.
  static constexpr std::size_t max_receivers = 64;
  static constexpr std::size_t max_servers = 2'000;

  /// One direction of one method, or an event.
  struct Seen {
    std::uint32_t most_bytes = 0;
    std::uint64_t messages = 0;
    Transport transport = Transport::udp;
    bool there = false;
    std::uint64_t first_frame = 0;
    std::set<std::pair<Transport, Endpoint>> receivers{};  ///< of events
    void add(const someip::Message& message, const traffic::Place& place);
  };
  struct Member {
    Seen request{};
    Seen response{};
    Seen event{};
    std::uint64_t errors = 0;
    bool answered = false;
    bool fire_and_forget = false;
    std::uint8_t interface_version = 1;
  };

  void tell(const traffic::Sighting& sighting) const;
  /// Who sends an answer or an event has the service.
  void note_server(someip::ServiceId service, const traffic::Place& place);
  /// Instances of services that nobody was seen to offer: where their messages came from.
  void add_servers(describe::Model& model) const;
  /// The eventgroups that a receiver's subscriptions name, as far as they were acknowledged.
  using Subscribed =
      std::map<std::tuple<someip::ServiceId, Transport, Endpoint>, std::set<someip::EventgroupId>>;
  [[nodiscard]] Subscribed subscribed() const;
  /// Those whose subscribers got an event. One with two subscriptions at one endpoint tells nothing.
  static std::vector<someip::EventgroupId> eventgroups_of(someip::ServiceId service, const Seen& event,
                                                          const Subscribed& subscribed);

  Announced announced_;
  traffic::NetworkView network_{max_services};
  std::map<std::tuple<someip::ServiceId, someip::MethodId>, Member> members_{};
  std::map<someip::ServiceId, std::set<std::pair<Transport, Endpoint>>> servers_{};
  std::size_t server_count_ = 0;
  traffic::TpAssembly segments_{};
  std::uint64_t messages_ = 0;
  std::uint64_t passed_over_ = 0;
  std::uint64_t without_service_ = 0;  ///< messages whose service id is none
};

/// What a model of a capture leaves open: a warning for each service with events of unknown eventgroups.
[[nodiscard]] std::vector<documents::Problem> what_is_open(const describe::Model& model);

/// The model of a recorded capture (pcap or pcapng).
/// @return with an error when it cannot be opened or read to its end; what came before the fault is there.
[[nodiscard]] describe::Reading read_capture(const std::string& file);

}  // namespace trestle::generate
