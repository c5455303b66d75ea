#pragma once
#include <array>
#include <boost/asio/local/stream_protocol.hpp>
#include <boost/asio/steady_timer.hpp>
#include <list>
#include <memory>
#include <string>
#include <vector>

#include "bridge/guest/frame.hpp"
#include "bridge/guest/host.hpp"
#include "sd/net/node.hpp"
#include "sd/net/proxy.hpp"

namespace trestle::guest {

/// What has come in this second.
struct Window {
  TimePoint began{};
  std::uint64_t count = 0;
  std::uint64_t bytes = 0;

  void add(TimePoint now, std::size_t size);
};

/// What all guests of a Host share.
struct Household {
  HostCounters counters{};
  Host::Judge judge{};
  Window passed{};

  /// Whether one more event may be passed on now.
  [[nodiscard]] bool has_budget(TimePoint now, std::size_t bytes);
};

/// A guest that has connected to a Host. It lives as long as it is connected.
class Visit : public std::enable_shared_from_this<Visit> {
 public:
  /// @param node  lives until end().
  Visit(boost::asio::local::stream_protocol::socket socket, std::shared_ptr<Household> household,
        sd::Node& node)
      : socket_{std::move(socket)},
        ticker_{socket_.get_executor()},
        household_{std::move(household)},
        node_{&node} {}

  /// @param may_stay  else it is told that there are others, and left.
  void begin(const Hello& hello, bool may_stay);
  void end();
  [[nodiscard]] bool is_connected() const { return socket_.is_open(); }
  /// Else nothing is done for it any more: it is only told why.
  [[nodiscard]] bool is_served() const { return node_ != nullptr; }

 private:
  struct Subscribed {
    sd::SubscribeSpec spec{};               ///< without events
    std::vector<sd::SubscriptionId> ids{};  ///< of one subscription on the wire
    std::uint32_t next_usual = 0;           ///< of what is not asked for yet; beyond the last: nothing
    bool active = false;
    bool others_told = false;
    sd::SubscriptionFaults faults{};  ///< that are told
  };
  /// Fire and forget, until it is sent.
  struct Sending {
    sd::Proxy* proxy;
    Call wish;  ///< without its payload
    std::shared_ptr<const std::vector<std::byte>> payload;
    TimePoint until;
  };

  void read_length();
  void read_body(std::size_t size);
  void on_frame(Frame frame);
  void on_request(const Find& wish);
  void on_request(Call wish);
  void on_request(const Subscribe& wish);
  void on_response(const sd::Proxy& proxy, const Call& wish, boost::system::error_code error,
                   const sd::Response& response);
  void subscribe_to_more(Subscribed& one);
  void subscribe(Subscribed& one, std::vector<someip::MethodId> events);
  void on_event(const someip::Message& message, const Endpoint& from);
  void release();

  void tick_later();
  void tick();
  void send_waiting();
  void tell_of(Subscribed& one);

  void say(const Frame& frame);
  void say_if_room(const Frame& frame);
  void refuse(std::uint64_t& counter, const std::string& why);
  void refuse_frame(const std::string& why);
  void flush();

  boost::asio::local::stream_protocol::socket socket_;
  boost::asio::steady_timer ticker_;
  const std::shared_ptr<Household> household_;
  sd::Node* node_;  ///< null: nothing is done for it any more
  TimePoint began_{};
  std::size_t requests_ = 0;
  std::vector<sd::RequirementId> requirements_;
  std::list<sd::Proxy> proxies_;
  std::vector<Sending> sendings_;
  std::vector<Subscribed> subscriptions_;
  Window arrived_;
  bool too_fast_ = false;
  bool usual_events_ = false;
  bool writing_ = false;
  std::uint64_t lost_ = 0;
  std::size_t waiting_events_ = 0;
  std::vector<std::byte> waiting_;
  std::vector<std::byte> sending_;
  std::array<std::byte, length_bytes> length_{};
  std::vector<std::byte> body_;
};

}  // namespace trestle::guest
