#pragma once
#include <fmt/format.h>

#include <functional>
#include <map>
#include <optional>
#include <random>
#include <string>
#include <vector>

#include "bridge/conform/profile.hpp"
#include "bridge/conform/restart_signs.hpp"
#include "bridge/conform/stimulus.hpp"
#include "bridge/conform/tester.hpp"
#include "bridge/conform/verdict.hpp"

namespace trestle::conform {

class Device;

/// What ends a case before its last line.
struct Ended {
  Verdict verdict{};
  std::string reason;
  std::vector<Difference> differences{};  ///< what belongs to the reason
};

/// An entry of a received SD message. The views in `message` live as long as the packet.
struct SeenEntry {
  Packet* packet = nullptr;
  someip::Header header{};
  sd::SdMessage message{};
  sd::Entry entry{};

  /// The options that the entry refers to.
  [[nodiscard]] std::vector<sd::Option> options() const;
  /// Those that are endpoints, of one role.
  [[nodiscard]] std::vector<sd::EndpointOption> endpoints(
      sd::EndpointRole role = sd::EndpointRole::unicast) const;
};

/// A received message that is none of service discovery.
struct SeenMessage {
  Packet* packet = nullptr;
  someip::Message message{};
};

/// The tester's numbers of SD messages, which go on from case to case.
class SdSessions {
 public:
  struct Next {
    someip::SessionId session{};
    bool reboot = true;
  };
  Next next(const Endpoint& to);
  /// The tester seems to have been restarted.
  void reboot() { relations_.clear(); }

 private:
  struct Relation {
    std::uint16_t session = 0;
    bool wrapped = false;
  };
  std::map<Endpoint, Relation> relations_;
};

/// What a case is given: one attempt at it.
class Trial {
 public:
  Trial(const Profile& profile, Tester& tester, Device& device, SdSessions& sessions);

  const Profile& profile;
  Tester& tester;
  SdSessions& sessions;

  /// Everything random is drawn from this, so that the seed of a run repeats it.
  std::mt19937_64 random{};
  /// The same numbers for the same case and seed. Requests count on from one of them.
  void begin(std::uint64_t seed, const std::string& id);

  // --- Judging --------------------------------------------------------------------------------------------

  /// Notes a difference, and goes on.
  template <typename Expected, typename Actual>
  void equal(const char* field, const Expected& expected, const Actual& actual, Packet* packet) {
    if (!(expected == actual)) {
      different(field, text(expected), text(actual), packet);
    }
  }
  void different(const std::string& field, const std::string& expected, const std::string& actual,
                 Packet* packet);
  /// Notes one unless this is true.
  void require(bool is_so, const char* field, const std::string& expected, const std::string& actual,
               Packet* packet) {
    if (!is_so) {
      different(field, expected, actual, packet);
    }
  }
  /// Ends the case: something else came than was expected, in this packet.
  /// @param reason  for people; `expected` and `actual` stand beside each other in reports.
  [[noreturn]] void fail(const std::string& reason, const std::string& expected, const std::string& actual,
                         Packet* packet);
  /// Ends the case: what had to come did not. In the evidence the message is marked that nothing came of: the
  /// last one that the case has sent; where there is none, the last one of all.
  [[noreturn]] void missing(const std::string& reason, const std::string& expected);
  [[noreturn]] void unsupported(const std::string& reason);
  [[noreturn]] void inconclusive(const std::string& reason);
  /// What was done is allowed; the verdict says that it was not what was hoped for.
  void nonstrict(const std::string& reason) { nonstrict_ = reason; }
  /// Of a packet in the evidence.
  static void comment(Packet* packet, const std::string& text);

  /// What the case has shown so far.
  [[nodiscard]] Attempt attempt() const;

  // --- Service discovery ----------------------------------------------------------------------------------

  /// A place in what was received: what comes later than this moment.
  [[nodiscard]] std::size_t now() {
    tester.receive_now();
    return tester.packets().size();
  }
  /// From now on SD messages to this endpoint of ours count, too: one that an SD endpoint option names.
  void hear_sd_at(const Endpoint& endpoint) { sd_endpoints_.push_back(endpoint); }
  using EntryIs = std::function<bool(const SeenEntry& seen)>;
  /// The entries that the device sent since then.
  [[nodiscard]] std::vector<SeenEntry> entries_since(std::size_t since, const EntryIs& wanted);
  [[nodiscard]] std::optional<SeenEntry> await_entry(std::size_t since, Duration within,
                                                     const EntryIs& wanted);

  void send_sd(const SdStimulus& stimulus, bool multicast = false, const char* what = "stimulus");
  /// From now on it is what the last packet is that was sent: a message that the device has to do something
  /// about.
  void is_stimulus(const std::string& what = "stimulus");
  /// Sends up to three times, until `done`: over UDP a datagram may get lost. What is sent again is counted.
  /// @param within  the time to wait each time
  /// @return whether it was done.
  bool ask(const std::function<void()>& send, Duration within, const std::function<bool()>& done);
  /// The same, with the time that the device has for an answer.
  bool ask(const std::function<void()>& send, const std::function<bool()>& done) {
    return ask(send, profile.timing.answer_within, done);
  }

  [[nodiscard]] static EntryIs is_offer(const ServiceProfile& service);
  /// An offer that answers to a Find: by unicast; where the profile says that it may come by multicast, one
  /// between two cyclic ones, too.
  [[nodiscard]] EntryIs is_find_answer(const ServiceProfile& service);
  /// Waits for the beginning of a cycle, where the profile says that Finds may be answered by multicast: in
  /// the first half they are answered by unicast, and no cyclic offer looks like an answer.
  /// [feat_req_someipsd_89]
  void await_unicast_answers();
  [[nodiscard]] static sd::Entry find_entry(const ServiceProfile& service);
  /// An offer of the service that the device sends by itself; where it does not, the answer to a Find. Ends
  /// the case when there is none.
  SeenEntry offer(const ServiceProfile& service);
  SeenEntry offer() { return offer(profile.service()); }
  /// The answer to a Find, which is sent up to three times.
  SeenEntry answer_to_find(const SdStimulus& find, bool multicast, const ServiceProfile& service);
  SeenEntry answer_to_find(const sd::Entry& find, bool multicast, const ServiceProfile& service,
                           std::uint8_t flags = sd::unicast_flag | sd::explicit_initial_data_flag) {
    return answer_to_find(SdStimulus{.entries = {find}, .flags = flags}, multicast, service);
  }

  /// The first eventgroup of the first service of which this is true; ends the case when there is none.
  const EventgroupProfile& eventgroup(bool (*is_one)(const EventgroupProfile&));
  /// One over UDP.
  const EventgroupProfile& eventgroup() {
    return eventgroup([](const EventgroupProfile& group) { return !group.tcp; });
  }

  /// A Subscribe, all right, with `endpoints`.
  [[nodiscard]] SdStimulus subscribe(const ServiceProfile& service, someip::EventgroupId group,
                                     std::vector<Bytes> endpoints, std::uint32_t ttl_s = 30,
                                     std::uint8_t counter = 0);
  /// The same of the first service, to our own UDP port.
  [[nodiscard]] SdStimulus subscribe(const EventgroupProfile& group, std::uint32_t ttl_s = 30);
  /// The option that names our UDP port.
  [[nodiscard]] Bytes own_endpoint();
  /// The entry that answers to what is sent up to three times.
  std::optional<SeenEntry> asked_for(const std::function<void()>& send, const EntryIs& wanted);
  /// Whether an entry answers this one: Ack or Nack.
  [[nodiscard]] static EntryIs is_answer_to(const sd::Entry& subscribe);
  /// Sends a Subscribe up to three times. Ends the case when there is no answer.
  SeenEntry answer_to(const SdStimulus& stimulus);
  /// The same, of the answer to the first entry alone, and ends the case when that is no Ack.
  SeenEntry acknowledged(const SdStimulus& stimulus);
  /// Sends a Subscribe that must not be acknowledged, and shows that the device has passed it. A Nack is
  /// noted.
  /// @return the Nack; nothing: it was ignored.
  std::optional<SeenEntry> not_acknowledged(const SdStimulus& stimulus);
  /// It is ended when this trial ends.
  void will_unsubscribe(const SdStimulus& stimulus) { subscriptions_.push_back(stimulus); }
  /// Ends a subscription that was made before.
  void unsubscribe(SdStimulus stimulus);
  /// An offer of a service that the device uses, all right, with `endpoints`.
  [[nodiscard]] static SdStimulus offer_of(const UsedService& used, std::vector<Bytes> endpoints,
                                           std::uint32_t ttl_s = 30);
  /// Offers a service of ours, by multicast, until this trial ends.
  void offer_ours(const SdStimulus& offer);
  /// Withdraws it.
  void withdraw(SdStimulus offer);

  // --- Calls and events -----------------------------------------------------------------------------------

  /// Our UDP port: opened when first asked for.
  PortId udp();
  /// A connection to the first service. Ends the case when it cannot be made.
  PortId tcp();
  [[nodiscard]] Endpoint udp_of(const ServiceProfile& service) const;
  [[nodiscard]] Endpoint tcp_of(const ServiceProfile& service) const;

  /// The request of the profile.
  [[nodiscard]] Call request() const { return request(profile.service()); }
  [[nodiscard]] Call request(const ServiceProfile& service) const;
  /// A method of the first service.
  [[nodiscard]] Call call(someip::MethodId method, Bytes payload = {}) const;
  /// Sends without waiting.
  /// @return the request as it went, with its session.
  Call send(Call call);
  Call send(Call call, const Endpoint& to, PortId from);

  using MessageIs = std::function<bool(const SeenMessage& seen)>;
  [[nodiscard]] std::vector<SeenMessage> messages_since(std::size_t since, const MessageIs& wanted);
  [[nodiscard]] std::optional<SeenMessage> await_message(std::size_t since, Duration within,
                                                         const MessageIs& wanted);
  /// A response or error with the Request ID of `call`.
  [[nodiscard]] static MessageIs is_answer_to(const Call& call);
  /// A notification of the first service.
  [[nodiscard]] MessageIs is_event(someip::MethodId event) const;

  /// Sends a request, over UDP up to three times. Ends the case when it is not answered.
  SeenMessage answer_to(Call call);
  /// The same; nothing: it is not answered.
  std::optional<SeenMessage> answer_if_any(Call call);
  /// Ends the case, as no answer came, where the device has ended a TCP connection since then.
  void must_be_open(std::size_t since);
  /// The answer to the request of a service over UDP, at its own port.
  /// @param who  for people: "instance 0x0002"
  SeenMessage answer_from(const ServiceProfile& service, const std::string& who);
  /// As answer_to(), and notes everything that is not as in a good response.
  SeenMessage good_answer_to(const Call& call);
  /// The same for an error.
  SeenMessage error_answer_to(const Call& call, std::optional<someip::ReturnCode> code = {});
  std::optional<SeenMessage> error_answer_if_any(const Call& call,
                                                 std::optional<someip::ReturnCode> code = {});
  /// Sends once, and shows that the device has passed it.
  /// @return the answers that came.
  std::vector<SeenMessage> answers_once_passed(const Call& call);
  /// Sends what must not be answered with success, and shows that the device has passed it.
  /// @return the error that came; nothing: it was ignored.
  std::optional<SeenMessage> not_served(const Call& call);
  /// Sends what must not be answered at all.
  void not_answered(const Call& call);
  /// Sends bytes from our UDP port to the first service.
  void send_bytes(ByteView datagram);
  /// Sends bytes on a TCP connection.
  void send_bytes(PortId connection, ByteView bytes);
  /// Asks the device something, so that all that was sent before has been dealt with when it answers. Ends
  /// the case when it does not answer. One without services is given the time for an answer.
  void pass();

  /// The initial values of an eventgroup, whose events these are. Ends the case when one does not come.
  /// @param subscribe  makes a right device send them, each time: it is called up to three times.
  std::vector<SeenMessage> initial_values(const std::vector<someip::MethodId>& events,
                                          const std::function<void()>& subscribe);
  /// The same by a Subscribe, which is ended before it is sent again.
  std::vector<SeenMessage> initial_values(const std::vector<someip::MethodId>& events,
                                          const SdStimulus& subscribe);
  /// The event of the profile that can be waited for; ends the case when there is none.
  [[nodiscard]] EventSource source();
  /// A subscription to it, at our own UDP port.
  [[nodiscard]] SdStimulus subscribe(const EventSource& source, std::uint32_t ttl_s = 30);
  /// Tells the device to send it, where it does not do so by itself.
  void ask_for(const EventSource& source);
  /// Asks for it up to three times, until `done`. One that comes by itself is waited for.
  bool ask_for(const EventSource& source, const std::function<bool()>& done);
  /// Asks for it, and waits until it must have come.
  /// @return what came of it.
  std::vector<SeenMessage> all_events(const EventSource& source);
  /// Asks for it up to three times, and waits for it; ends the case when it does not come.
  /// @param to  the subscriber; nothing: any.
  SeenMessage event(const EventSource& source, std::optional<Endpoint> to = {});

  /// Whether the device is there: it answers to a Find, or to the request of the profile if there is one, or,
  /// where it does neither, it repeats its offers; one without services subscribes to what it uses. Each way
  /// in which it does is what alive() asks for from then on.
  bool is_there();
  bool alive();
  /// Ours, UDP and TCP: next time there are new ones.
  void close_ports();
  /// Ends all subscriptions that this trial has made, and closes its ports.
  void clean_up();
  /// What a device sends when it has started: an offer of its first service; where it has none, a Find for
  /// the service that it uses.
  [[nodiscard]] EntryIs is_start() const;
  /// Restarts the device, and waits until it has started: as long as the profile says (ready_within). Where
  /// it is restarted by a command or a person, it is its own messages that show the restart
  /// (restart_signs.hpp). Ends the case when it does not start.
  /// @return the place in what was received where its new life begins.
  std::size_t restart(bool at_once = false);
  /// As the profile says, without waiting for its messages. How long that takes is no stall of the tester.
  void stop_device(bool at_once = false);
  void start_device();

 private:
  static constexpr int tries = 3;
  /// What the evidence says of messages that no case has asked for.
  static constexpr const char* check = "check: is the device there?";
  /// Offers that come more seldom are not waited for.
  static constexpr Duration longest_cycle = std::chrono::seconds{5};

  template <typename T>
  static std::string text(const T& value) {
    if constexpr (std::is_same_v<T, bool>) {
      return value ? "yes" : "no";
    } else if constexpr (std::is_enum_v<T>) {
      return fmt::format("{:#04x}", static_cast<unsigned>(value));
    } else if constexpr (std::is_integral_v<T>) {
      return fmt::format("{} ({:#x})", value, value);
    } else {
      return fmt::format("{}", value);
    }
  }

  [[nodiscard]] bool is_sd(const Packet& packet) const;
  bool answers_find();
  bool is_offer_by_multicast(Packet& packet);
  std::optional<WallTime> last_offer_by_multicast(WallTime before);
  /// An offer of the first service by multicast, too soon after the one before to be a cyclic one: an answer.
  /// Who answers by multicast does so only in the second half of a cycle.  [feat_req_someipsd_89, 90]
  bool is_between_cycles(const SeenEntry& seen);
  bool answers_request();
  bool offers_by_itself();
  /// Whether the device takes a service that it uses: all that one without services answers to.
  bool subscribes();
  [[nodiscard]] std::vector<SeenEntry> entries_of(Packet& packet) const;
  /// Of what the device sent to service discovery.
  [[nodiscard]] std::optional<SdSign> sign_of(Packet& packet) const;

  Device& device_;
  bool finds_ = true;
  bool requests_;
  bool offers_only_ = false;
  std::optional<PortId> udp_;
  std::optional<PortId> tcp_;
  std::uint16_t session_ = 0;
  std::vector<SdStimulus> subscriptions_;
  std::vector<SdStimulus> offers_;
  bool asked_all_ = false;  ///< a Find went to the group
  std::vector<Endpoint> sd_endpoints_;
  std::vector<Difference> differences_;
  std::string nonstrict_;
  Packet* stimulus_ = nullptr;
  int retries_ = 0;
  bool unanswered_ = false;
  int most_asked_ = 1;  ///< how often that was sent which was answered last of all
};

/// "00 2a ff", cut after some.
[[nodiscard]] std::string hex(ByteView bytes);

}  // namespace trestle::conform
