#pragma once
#include <boost/asio/io_context.hpp>
#include <chrono>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <string>

#include "bridge/guest/frame.hpp"
#include "someip/wire/counters.hpp"

namespace trestle::sd {
class Node;
struct SubscribeSpec;
}  // namespace trestle::sd

namespace trestle::guest {

/// What guests did, and what they did not get.
struct HostCounters {
  std::uint64_t guests = 0;
  std::uint64_t requests = 0;
  std::uint64_t events = 0;            ///< passed on
  std::uint64_t guests_refused = 0;    ///< as many as may be are there
  std::uint64_t requests_refused = 0;  ///< too many of one guest, or they cannot be
  std::uint64_t frames_refused = 0;    ///< no requests at all; who sends one is left
  std::uint64_t events_unread = 0;     ///< not passed on: the guest reads too slowly
  std::uint64_t lines_unread = 0;      ///< likewise, of services found and lines for people
  std::uint64_t events_too_many = 0;   ///< not passed on: more come than the bridge passes on
  std::uint64_t ended_too_fast = 0;    ///< guests that got far more than that
  template <typename Visit>
  constexpr void for_each_counter(Visit visit) const {
    using enum someip::CounterKind;
    visit("guests", guests, traffic);
    visit("requests", requests, traffic);
    visit("events", events, traffic);
    visit("guests_refused", guests_refused, loss);
    visit("requests_refused", requests_refused, loss);
    visit("frames_refused", frames_refused, loss);
    visit("events_unread", events_unread, loss);
    visit("lines_unread", lines_unread, loss);
    visit("events_too_many", events_too_many, loss);
    visit("ended_too_fast", ended_too_fast, loss);
  }
};

/// The bridge's end: looks for services, calls and subscribes in place of tools, by the Node of the bridge.
///
/// Only this user and root may connect. Whoever does costs the bridge little, whatever it wants and however
/// slowly it reads: see the limits. On the thread that runs the io_context.
class Host {
 public:
  static constexpr std::size_t most_guests = 4;    ///< at a time
  static constexpr std::size_t most_requests = 8;  ///< of a guest
  /// With those that are left, and have not read why.
  static constexpr std::size_t most_connections = 16;
  // What waits for a guest, while as much again is being sent to it.
  static constexpr std::size_t most_waiting_events = 1024;
  static constexpr std::size_t most_waiting_bytes = most_frame_bytes;
  /// Between one guest and the next.
  static constexpr std::chrono::milliseconds spacing{20};
  /// A guest that has asked for nothing until then is left.
  static constexpr std::chrono::seconds patience{5};
  // What is passed on to all guests together in a second.
  static constexpr std::uint64_t most_events = 2000;
  static constexpr std::uint64_t most_event_bytes = std::uint64_t{16} << 20U;
  /// So many times that, for one guest, ends its subscriptions: receiving costs the bridge something, too.
  static constexpr std::uint64_t far_too_many = 4;

  /// Nobody is let in before open().
  /// @param folder  of console::status_folder(). The socket has the name of this process.
  /// @throws boost::system::system_error when it cannot be opened.
  Host(boost::asio::io_context& io, const std::filesystem::path& folder);
  /// Removes the socket.
  ~Host();
  Host(const Host&) = delete;
  Host& operator=(const Host&) = delete;

  /// What the bridge has to say of a subscription that a guest wants: may change it so that its own get each
  /// event once, or says why it cannot be.
  using Judge = std::function<std::string(sd::SubscribeSpec& wish)>;

  /// @param node  lives until close().
  /// @param at  its service discovery.
  void open(sd::Node& node, const Endpoint& at, std::string configuration, Judge judge);
  /// All guests are left.
  void close();

  [[nodiscard]] const std::filesystem::path& path() const noexcept;
  [[nodiscard]] const HostCounters& counters() const noexcept;

 private:
  class Implementation;
  std::shared_ptr<Implementation> implementation_;
};

}  // namespace trestle::guest
