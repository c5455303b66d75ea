#include "bridge/traffic/live/live_frames.hpp"

#include <fmt/format.h>
#include <ifaddrs.h>
#include <net/if.h>

#include <array>
#include <cerrno>
#include <filesystem>
#include <memory>

#include "someip/net/address_text.hpp"
#include "someip/net/addresses.hpp"
#include "someip/net/socket_calls.hpp"

namespace trestle::traffic {
namespace {

/// Frames that are taken before other handlers run.
constexpr int frames_at_a_time = 1000;

std::string program() {
  std::error_code error;
  const auto path = std::filesystem::read_symlink("/proc/self/exe", error);
  return error ? "trestle" : path.string();
}

/// Name of the network interface that has this address; nothing when none has.
std::optional<std::string> interface_name(const IpAddress& address) {
  std::array<char, IF_NAMESIZE> name{};
  const unsigned index = someip::interface_of(address);
  return index != 0 && if_indextoname(index, name.data()) != nullptr ? std::optional<std::string>{name.data()}
                                                                     : std::nullopt;
}

/// The first address of an interface, IPv4 or IPv6; nothing when it has none.
std::optional<IpAddress> address_of_interface(const std::string& name, bool v6) {
  ifaddrs* all = nullptr;
  if (getifaddrs(&all) != 0) {
    return std::nullopt;
  }
  const std::unique_ptr<ifaddrs, decltype(&freeifaddrs)> owner{all, &freeifaddrs};
  for (const ifaddrs* one = all; one != nullptr; one = one->ifa_next) {
    if (one->ifa_addr != nullptr && name == one->ifa_name &&
        one->ifa_addr->sa_family == (v6 ? AF_INET6 : AF_INET)) {
      someip::SocketAddress address;
      address.assign(*one->ifa_addr);
      return address.endpoint().address;
    }
  }
  return std::nullopt;
}

/// The address from which the system sends multicast, if it can.
std::optional<IpAddress> own_address(const cli::NetworkOptions& options) {
  try {
    return options.config().address;
  } catch (const std::runtime_error&) {
    return std::nullopt;
  }
}

}  // namespace

TimePoint wall_clock() {
  return TimePoint{std::chrono::duration_cast<Duration>(std::chrono::system_clock::now().time_since_epoch())};
}

Where where_of(const std::string& interface, const cli::NetworkOptions& options) {
  sd::NodeConfig network = interface.empty() ? options.config() : options.config_without_address();
  if (!network.address.is_unspecified()) {
    const auto own = interface_name(network.address);
    if (!own) {
      someip::fail(Transport::udp, {network.address, network.port}, "find the network interface",
                   EADDRNOTAVAIL);
    }
    return {interface.empty() ? *own : interface, network};
  }
  const auto address =
      interface == "any" ? own_address(options) : address_of_interface(interface, network.multicast.v6);
  if (!address) {
    return {interface, std::nullopt};
  }
  network.address = *address;
  return {interface, network};
}

LiveFrames::LiveFrames(cli::Session& session, const Where& where, OnFrame on_frame,
                       Listener::Handler on_sd_datagram)
    : session_{session}, on_frame_{std::move(on_frame)}, where_{where.interface} {
  capture(where);
  if (!where.network) {
    return;
  }
  // Joining the group makes switches send its messages here; they are then seen in the captured frames.
  try {
    listener_.emplace(session.io, *where.network,
                      [this, told = std::move(on_sd_datagram)](ByteView datagram, const Endpoint& from,
                                                               const Endpoint& to) {
                        if (!capture_) {
                          told(datagram, from, to);
                        }
                      });
  } catch (const someip::NetError&) {
    if (!capture_) {
      throw;
    }
  }
}

LiveFrames::~LiveFrames() {
  if (readable_) {
    readable_->release();  // the capture owns the file descriptor
  }
}

void LiveFrames::capture(const Where& where) {
  try {
    capture_.emplace(where.interface);
  } catch (const pcaps::CaptureDenied& error) {
    const std::string hint =
        fmt::format("'sudo setcap cap_net_raw+ep {}' allows it, and so does sudo", program());
    if (!where.network) {
      throw std::runtime_error{std::string{error.what()} + ". " + hint};
    }
    cli::Session::note(
        fmt::format("note: {}: only what discovery sends to all is shown, no subscriptions and no traffic.\n"
                    "      {}",
                    error.what(), hint));
    where_ =
        fmt::format("{} from {}", someip::to_string(Endpoint{where.network->multicast, where.network->port}),
                    someip::to_string(where.network->address));
    return;
  }
  readable_.emplace(session_.io, capture_->fd());
  wait();
}

void LiveFrames::wait() {
  readable_->async_wait(boost::asio::posix::stream_descriptor::wait_read,
                        [this](const boost::system::error_code& error) {
                          if (!error) {
                            on_readable();
                          }
                        });
}

void LiveFrames::on_readable() {
  for (int i = 0; i < frames_at_a_time; ++i) {
    const auto frame = capture_->next();
    if (!frame) {
      break;
    }
    on_frame_(*frame);
  }
  if (capture_->error().empty()) {
    wait();
  } else {
    session_.finish();
  }
}

void LiveFrames::check() const {
  if (capture_ && !capture_->error().empty()) {
    throw std::runtime_error{"the capture ended: " + capture_->error()};
  }
}

}  // namespace trestle::traffic
