#pragma once
#include <array>
#include <functional>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <tuple>
#include <vector>

#include "bridge/conform/replay/copies.hpp"
#include "bridge/conform/replay/rules.hpp"
#include "bridge/conform/runner.hpp"
#include "bridge/traffic/message_sink.hpp"
#include "sd/wire/message.hpp"
#include "someip/wire/tp.hpp"

namespace trestle::conform {

/// Judges the messages of captures. What a rule says of the past, such as that a response had a request, is
/// judged only where the capture can show it: a capture may begin at any time, and may lack packets.
class Replay : public traffic::MessageSink {
 public:
  /// @param only_host  judge what this host sends; nothing: all.
  explicit Replay(std::optional<IpAddress> only_host = {}) : only_host_{only_host} {}

  /// What comes next is of another capture.
  /// @param name   for differences; empty: there is only one.
  /// @param learn  is told of endpoints that carry SOME/IP, as service discovery says.
  /// @param twice  it holds most packets twice, so that copies are left out.
  void begin(std::string name, std::function<void(Transport, const Endpoint&)> learn, bool twice = false);
  bool message(const traffic::Place& place, std::size_t offset, const someip::Message& message) override;
  void undecodable(const traffic::Place& place, std::size_t offset, ByteView bytes,
                   const traffic::Violation& violation) override;
  void broken_frame(const traffic::Place& place, const traffic::Violation& violation) override;
  /// The capture is over.
  void end();

  [[nodiscard]] std::uint64_t messages() const noexcept { return messages_; }
  /// A result for each rule; of rules that nothing in the captures was about: unsupported.
  [[nodiscard]] std::vector<CaseResult> results(const std::string& evidence) const;

 private:
  struct Tally {
    std::uint64_t judged = 0;
    std::uint64_t broken = 0;
    std::vector<Difference> differences{};  ///< the first ones
    Timeline timeline{};
  };
  /// A message at hand, for what is said of it.
  struct At {
    const traffic::Place& place;
    const someip::Message& message;
  };

  /// Of services and subscriptions, and of pairs of hosts.
  static constexpr std::size_t most_relations = 50'000;

  /// The options of an entry, sorted.
  using Options = std::vector<std::vector<std::byte>>;

  /// Judges: the rule is kept, or not.
  void check(Rule rule, const At& at, bool kept, const std::string& field, const std::string& expected,
             const std::string& actual);
  void note_broken(Rule rule, const traffic::Place& place, const std::string& text, const std::string& field,
                   const std::string& expected, const std::string& actual);
  [[nodiscard]] static Options options_of(const sd::SdMessage& message, const sd::Entry& entry);
  [[nodiscard]] bool is_judged(const traffic::Place& place) const {
    return !only_host_ || place.flow.from.address == *only_host_;
  }

  void judge_header(const At& at);
  void judge_cookie(const At& at);
  void judge_connection(const At& at);
  void judge_session_of_call(const At& at);
  void judge_event(const At& at);
  void judge_meaning(const At& at);
  void judge_session_of_event(const At& at);
  void judge_version(const At& at);
  void judge_source(const At& at);
  void remember(const At& at);
  void judge_rpc(const At& at);
  void judge_tp(const At& at);
  void judge_sd(const At& at);
  void judge_sd_session(const At& at, const sd::SdMessage& message);
  void judge_options(const At& at, const sd::SdMessage& message);
  void judge_layout(const At& at, const sd::Option& option);
  void judge_sd_endpoint(const At& at, const sd::SdMessage& message);
  void judge_other_protocol(const At& at, const sd::SdMessage& message, const sd::Entry& entry);
  void judge_entry(const At& at, const sd::SdMessage& message, const sd::Entry& entry);
  void judge_ids(const At& at, const sd::Entry& entry);
  void judge_offer(const At& at, const sd::SdMessage& message, const sd::Entry& entry);
  void judge_places(const At& at, const sd::SdMessage& message, const sd::Entry& entry);
  void judge_transports(const At& at, const sd::SdMessage& message, const sd::Entry& entry);
  void note_served(std::uint16_t service, std::uint8_t major, Transport transport, const Endpoint& endpoint);
  void judge_subscriber(const At& at, const sd::SdMessage& message, const sd::Entry& entry);
  void judge_subscription(const At& at, const sd::SdMessage& message, const sd::Entry& entry);
  void judge_pairs(const At& at, const sd::SdMessage& message);

  struct Request {
    std::uint8_t interface_version = 0;
    bool answered = false;
  };
  /// Client, server, Message ID and Request ID.
  using RequestKey = std::tuple<Endpoint, Endpoint, std::uint32_t, std::uint32_t>;
  /// Client, server, Message ID and Client ID.
  using CallerKey = std::tuple<Endpoint, Endpoint, std::uint32_t, std::uint16_t>;
  /// Ports that a client uses for one thing. One after another is how it comes back; taking turns shows that
  /// there are two.
  struct Ports {
    std::uint16_t current = 0;
    std::set<std::uint16_t> earlier{};

    /// @return whether this one had its turn before, and another one after it.
    bool takes_turns(std::uint16_t port) {
      if (port == current) {
        return false;
      }
      current = port;
      return !earlier.insert(port).second;
    }
  };
  /// What the offers of a service name at a host, in the whole of the capture.
  struct Served {
    std::set<std::uint8_t> majors{};
    std::set<std::pair<Transport, Endpoint>> endpoints{};
  };
  using ServedKey = std::pair<IpAddress, std::uint16_t>;
  /// A Session ID that came so often in a row.
  struct Run {
    std::uint16_t session = 0;
    unsigned times = 0;
  };
  struct Segments {
    std::uint64_t next = 0;  ///< offset of the next segment
    std::size_t size = 0;    ///< of the first one
    std::uint8_t interface_version = 0;
    someip::ReturnCode code{};
  };
  using SegmentsKey = std::tuple<traffic::Flow, std::uint32_t, std::uint32_t, std::uint8_t>;
  struct Sessions {
    std::uint16_t last = 0;
    bool reboot = false;
  };
  struct Offered {
    std::uint32_t minor = 0;
    Options options{};
    std::uint64_t times = 0;
    bool udp = false;
    bool tcp = false;
  };
  /// Server, service, instance and major version.
  using OfferKey = std::tuple<IpAddress, std::uint16_t, std::uint16_t, std::uint8_t>;
  /// Server, service, major version, and an endpoint that is offered.
  using PlaceKey = std::tuple<IpAddress, std::uint16_t, std::uint8_t, Transport, Endpoint>;
  struct Subscription {
    std::uint32_t ttl_s = 0;
    Options options{};
    bool answered = false;
    bool is_first = false;  ///< there was none before the capture began
    std::uint64_t frame = 0;
    pcaps::Timestamp time{};
    traffic::Flow flow{};
    std::string text{};
  };
  /// Client, server, service, instance, eventgroup and counter.
  using SubscriptionKey = std::tuple<IpAddress, IpAddress, std::uint32_t, std::uint16_t, std::uint8_t>;

  std::optional<IpAddress> only_host_;
  std::string name_;
  std::function<void(Transport, const Endpoint&)> learn_;
  std::optional<Copies> copies_;  ///< of a capture that holds most packets twice
  std::uint64_t messages_ = 0;
  std::size_t captures_ = 0;
  std::optional<pcaps::Timestamp> first_;
  pcaps::Timestamp last_{};
  std::array<Tally, static_cast<std::size_t>(Rule::count)> tallies_{};
  std::uint64_t reboots_ = 0;

  std::map<RequestKey, Request> requests_;
  std::set<std::pair<Endpoint, Endpoint>> talked_;   ///< who has sent something to whom, besides discovery
  std::map<CallerKey, std::uint16_t> last_session_;  ///< of calls
  std::map<traffic::Flow, pcaps::Timestamp> last_cookie_;
  std::map<std::pair<IpAddress, Endpoint>, Ports> connections_;
  std::map<OfferKey, Offered> offers_;
  std::map<PlaceKey, std::uint16_t> places_;  ///< the instance that is offered there
  std::map<ServedKey, Served> served_;
  std::size_t served_endpoints_ = 0;
  std::map<std::uint32_t, bool> is_event_;  ///< by Message ID
  std::map<CallerKey, Run> event_sessions_;
  std::map<SegmentsKey, Segments> segments_;
  std::map<std::pair<Endpoint, Endpoint>, Sessions> sessions_;
  std::map<SubscriptionKey, Subscription> subscriptions_;
  std::map<SubscriptionKey, Ports> subscriber_ports_;
  std::set<std::pair<IpAddress, IpAddress>> subscribers_;  ///< who has subscribed at whom
};

}  // namespace trestle::conform
