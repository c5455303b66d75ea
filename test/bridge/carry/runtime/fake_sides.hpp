#pragma once
#include <map>
#include <memory>
#include <set>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "bridge/carry/runtime/dds_side.hpp"
#include "bridge/carry/runtime/someip_side.hpp"

/// What routes have to do with in their tests, in place of a network: nobody is there, and nothing waits but
/// for its time-out.
namespace trestle::test {

using Bytes = std::vector<std::byte>;

inline Bytes joined(std::span<const ByteView> slices) {
  Bytes all;
  for (const ByteView slice : slices) {
    all.insert(all.end(), slice.begin(), slice.end());
  }
  return all;
}

/// DDS with one end of ours of each kind at most, but for readers.
class FakeDds final : public carry::DdsSide {
 public:
  bool no_reader = false;  ///< can be made
  int reads = 0;           ///< readers
  dds::Qos asked{};        ///< by the last one
  bool writes = false;
  bool serves = false;
  bool calls = false;
  int made = 0;             ///< writers and servers
  std::size_t matched = 1;  ///< counterparts of the reader or writer
  dds::OnSample on_sample;
  dds::ReaderCounters reader_counters;
  std::vector<Bytes> written;
  std::optional<dds::WriteError> refuses_to_write;
  // A ROS service that is called, and one that is served.
  bool ready = true;
  struct Call {
    Bytes request;
    dds::ServiceClient::Handler handler;
    dds::TimePoint deadline;
  };
  std::vector<Call> called;
  dds::ServiceServer::Handler on_request;
  std::vector<Bytes> replies;
  std::optional<dds::TimePoint> served_until;  ///< when the server has something to do
  std::function<void()> wake;
  std::vector<dds::FoundWriter> found;  ///< writers of others
  mutable int looks = 0;                ///< at them
  dds::OnMatch on_match;                ///< of our writer
  std::vector<dds::Counterpart> counterparts_found;
  std::vector<dds::BridgeEnd> ends;  ///< of other bridges

  std::unique_ptr<carry::DdsReader> reader(std::string_view /*topic*/, std::string_view /*type*/,
                                           const dds::Qos& qos, dds::OnSample told, std::size_t /*most*/,
                                           dds::EndpointExtras /*extras*/) override {
    if (no_reader) {
      throw std::runtime_error{"there is no reader"};
    }
    on_sample = std::move(told);
    asked = qos;
    return std::make_unique<Reader>(*this);
  }
  std::unique_ptr<carry::DdsWriter> writer(std::string_view /*topic*/, std::string_view /*type*/,
                                           const dds::Qos& /*qos*/, std::size_t /*most*/,
                                           dds::EndpointExtras extras) override {
    ++made;
    on_match = std::move(extras.on_match);
    return std::make_unique<Writer>(*this);
  }
  std::unique_ptr<carry::DdsClient> client(const dds::ServiceConfig& /*config*/,
                                           std::function<void()> waker) override {
    wake = std::move(waker);
    return std::make_unique<Client>(*this);
  }
  std::unique_ptr<carry::DdsServer> server(const dds::ServiceConfig& /*config*/, std::function<void()> waker,
                                           dds::ServiceServer::Handler told) override {
    wake = std::move(waker);
    on_request = std::move(told);
    ++made;
    return std::make_unique<Server>(*this);
  }
  std::vector<dds::FoundWriter> writers() const override {
    ++looks;
    return found;
  }
  std::vector<dds::BridgeEnd> bridge_ends(std::string_view /*topic*/) const override { return ends; }
  std::uint64_t bridge_changes() const override { return ends.size(); }
  std::vector<dds::Counterpart> counterparts(std::string_view /*topic*/, bool /*writers*/) const override {
    return counterparts_found;
  }
  std::size_t peers() const override { return 0; }
  std::uint64_t not_remembered() const override { return 0; }

 private:
  // Says whether there is such an end.
  class Here {
   public:
    explicit Here(bool& is_here) : is_here_{is_here} { is_here_ = true; }
    ~Here() { is_here_ = false; }
    Here(const Here&) = delete;
    Here& operator=(const Here&) = delete;

   private:
    bool& is_here_;
  };
  struct Reader final : carry::DdsReader {
    explicit Reader(FakeDds& all) : of{all} { ++of.reads; }
    ~Reader() override { --of.reads; }
    Reader(const Reader&) = delete;
    Reader& operator=(const Reader&) = delete;
    std::size_t matched() const override { return of.matched; }
    dds::ReaderCounters counters() const override { return of.reader_counters; }
    FakeDds& of;
  };
  struct Writer final : carry::DdsWriter {
    explicit Writer(FakeDds& all) : of{all}, here{all.writes} {}
    tl::expected<void, dds::WriteError> write(std::span<const ByteView> slices) override {
      if (of.refuses_to_write) {
        ++refused;
        return tl::unexpected{*of.refuses_to_write};
      }
      of.written.push_back(joined(slices));
      return {};
    }
    void forget_written() override { of.written.clear(); }
    std::size_t matched() const override { return of.matched; }
    dds::WriterCounters counters() const override { return {.refused = refused}; }
    FakeDds& of;
    Here here;
    std::uint64_t refused = 0;
  };
  struct Client final : carry::DdsClient {
    explicit Client(FakeDds& all) : of{all}, here{all.calls} {}
    bool ready() const override { return of.ready; }
    void call(std::span<const ByteView> slices, std::chrono::nanoseconds timeout, dds::TimePoint now,
              dds::ServiceClient::Handler handler) override {
      of.called.push_back({joined(slices), std::move(handler), now + timeout});
    }
    void work(dds::TimePoint now) override {
      for (Call& one : of.called) {
        if (one.handler && one.deadline <= now) {
          std::exchange(one.handler, nullptr)(tl::unexpected{dds::CallFault::timed_out});
        }
      }
    }
    std::optional<dds::TimePoint> deadline() const override {
      std::optional<dds::TimePoint> first;
      for (const Call& one : of.called) {
        if (one.handler && (!first || one.deadline < *first)) {
          first = one.deadline;
        }
      }
      return first;
    }
    dds::ServiceClientCounters counters() const override { return {}; }
    FakeDds& of;
    Here here;
  };
  struct Server final : carry::DdsServer {
    explicit Server(FakeDds& all) : of{all}, here{all.serves} {}
    void reply(const dds::RequestId& /*id*/, std::span<const ByteView> slices, dds::TimePoint now) override {
      of.replies.push_back(joined(slices));
      of.served_until = now + std::chrono::seconds{1};
    }
    void work(dds::TimePoint now) override {
      if (of.served_until <= now) {
        of.served_until.reset();
      }
    }
    std::optional<dds::TimePoint> deadline() const override { return of.served_until; }
    dds::ServiceServerCounters counters() const override { return {}; }
    FakeDds& of;
    Here here;
  };
};

/// SOME/IP with one service of others and one subscription at most.
class FakeSomeip final : public carry::SomeipSide, private sd::AnswerTaker {
 public:
  std::optional<sd::ServiceSpec> offered;             ///< the last service of ours
  std::map<std::uint16_t, someip::ServiceId> offers;  ///< all of them
  std::set<someip::ServiceId> of_others;              ///< services that others offer, too
  int ports = 0;                                      ///< that are held
  std::size_t subscriber_count = 1;
  std::vector<Bytes> events;                       ///< sent to them
  std::vector<std::shared_ptr<const void>> holds;  ///< what senders have not let go of
  bool holds_all = false;
  std::shared_ptr<const Bytes> value;  ///< of the field
  std::vector<std::pair<someip::ReturnCode, Bytes>> answers;
  bool sends_answers = true;
  std::size_t without_room = 0;  ///< subscribers for which too much waits
  std::function<void()> asked;   ///< to tell of room

  bool is_there = false;  ///< the service of others
  sd::AvailabilityHandler on_service;
  sd::EventHandler on_event;  ///< empty: not subscribed to
  bool acknowledged = true;
  sd::SubscriptionFaults faults;  ///< of the subscription
  struct Called {
    sd::CallSpec spec;
    Bytes payload;
    std::weak_ptr<carry::CallEnds> ends;
    carry::Caller caller;
  };
  std::vector<Called> called;

  /// A request of the method that is offered first.
  void request(const Bytes& payload, std::size_t method = 0, const someip::e2e::CheckResult* check = nullptr,
               const Endpoint& from = {}) {
    const someip::Header header{.method = offered->methods.at(method).id,
                                .session = someip::SessionId{1},
                                .type = someip::MessageType::request};
    offered->methods.at(method).handler({.header = header, .payload = payload, .check = check},
                                        sd::Responder{header, {}, {.to = from, .taker = this}, true});
  }
  /// Ends a call that was made.
  void respond(std::size_t call, boost::system::error_code error, const Bytes& payload) {
    const Called one = called.at(call);
    if (const auto ends = one.ends.lock()) {
      ends->on_response(one.caller, error, {.payload = payload});
    }
  }
  void service_comes_or_goes(bool there) {
    is_there = there;
    on_service(remote(), there);
  }

  sd::OfferHandle offer(const sd::ServiceSpec& spec) override {
    offered = spec;
    offers.emplace(++last_offer_, spec.service);
    return {.index = last_offer_, .generation = 1};
  }
  void withdraw(sd::OfferHandle offer) override {
    offered.reset();
    offers.erase(offer.index);
  }
  std::shared_ptr<const void> hold_port(std::uint16_t /*number*/, Transport /*transport*/) override {
    ++ports;
    return {this, [this](const void*) { --ports; }};
  }
  std::size_t subscribers(sd::OfferHandle /*offer*/, someip::MethodId /*event*/) const override {
    return subscriber_count;
  }
  sd::Notified notify(sd::OfferHandle /*offer*/, someip::MethodId /*event*/,
                      std::span<const ByteView> payload, const std::shared_ptr<const void>& keep_alive,
                      const someip::TpPacing& /*pacing*/) override {
    const std::size_t sent_to = subscriber_count - without_room;
    if (sent_to == 0 && without_room > 0) {
      return {.dropped = without_room, .no_room = without_room};
    }
    events.push_back(joined(payload));
    if (holds_all) {
      holds.push_back(keep_alive);
    }
    return {.subscribers = sent_to, .dropped = without_room, .no_room = without_room};
  }
  void when_room(sd::OfferHandle /*offer*/, someip::MethodId /*event*/, std::size_t /*bytes*/,
                 std::function<void()> told) override {
    asked = std::move(told);
  }
  /// There is room again.
  void make_room() {
    without_room = 0;
    std::exchange(asked, nullptr)();
  }
  sd::Notified set_field(sd::OfferHandle /*offer*/, someip::MethodId /*field*/,
                         std::shared_ptr<const Bytes> now) override {
    value = std::move(now);
    events.push_back(*value);
    return {.subscribers = subscriber_count};
  }
  std::shared_ptr<const Bytes> field(sd::OfferHandle /*offer*/, someip::MethodId /*field*/) const override {
    return value;
  }
  void forget_field(sd::OfferHandle /*offer*/, someip::MethodId /*field*/) override { value.reset(); }

  sd::RequirementId require(const sd::RequireSpec& /*spec*/, sd::AvailabilityHandler handler) override {
    on_service = std::move(handler);
    return sd::RequirementId{1};
  }
  std::vector<sd::RemoteService> available(sd::RequirementId /*requirement*/) const override { return all(); }
  bool is_offered_by_others(someip::ServiceId service) const override { return of_others.contains(service); }
  std::unique_ptr<carry::SomeipClient> client(const sd::RequireSpec& /*spec*/,
                                              sd::AvailabilityHandler handler) override {
    on_service = std::move(handler);
    return std::make_unique<Client>(*this);
  }
  sd::SubscriptionId subscribe(const sd::SubscribeSpec& /*spec*/, sd::EventHandler handler) override {
    on_event = std::move(handler);
    return sd::SubscriptionId{1};
  }
  void unsubscribe(sd::SubscriptionId /*subscription*/) override { on_event = nullptr; }
  bool subscribed(sd::SubscriptionId /*subscription*/) const override { return acknowledged; }
  sd::SubscriptionFaults subscription_faults(sd::SubscriptionId /*subscription*/) const override {
    return faults;
  }
  sd::OtherEvents other_events(sd::SubscriptionId /*subscription*/) const override { return {}; }

 private:
  static sd::RemoteService remote() {
    sd::RemoteService service;
    service.service = someip::ServiceId{0x1234};
    service.instance = someip::InstanceId{1};
    service.udp = Endpoint{IpAddress::v4(10, 0, 0, 2), 30501};
    return service;
  }
  std::vector<sd::RemoteService> all() const {
    return is_there ? std::vector{remote()} : std::vector<sd::RemoteService>{};
  }
  bool take(const someip::Header& header, std::span<const ByteView> payload) override {
    if (sends_answers) {
      answers.emplace_back(header.return_code, joined(payload));
    }
    return sends_answers;
  }
  struct Client final : carry::SomeipClient {
    explicit Client(FakeSomeip& all) : of{all} {}
    std::vector<sd::RemoteService> available() const override { return of.all(); }
    void call(const sd::CallSpec& spec, Bytes payload, std::weak_ptr<carry::CallEnds> ends,
              carry::Caller caller) override {
      of.called.push_back({spec, std::move(payload), std::move(ends), std::move(caller)});
    }
    bool send(const sd::CallSpec& spec, ByteView payload) override {
      of.called.push_back({spec, {payload.begin(), payload.end()}, {}, {}});
      return of.sends_answers;
    }
    FakeSomeip& of;
  };
  std::uint16_t last_offer_ = 0;
};

}  // namespace trestle::test
