#pragma once
#include <array>
#include <boost/asio/io_context.hpp>
#include <boost/asio/local/stream_protocol.hpp>
#include <filesystem>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "bridge/guest/frame.hpp"

namespace trestle::guest {

/// The tool's end of a connection to a bridge of this host.
class Guest {
 public:
  /// The bridge that has this endpoint of service discovery.
  /// @param faults  gets a line for each bridge that could not be asked.
  /// @return null: there is none, as far as this user may see.
  [[nodiscard]] static std::unique_ptr<Guest> of(boost::asio::io_context& io, const Endpoint& at,
                                                 std::vector<std::string>& faults);

  Guest(boost::asio::local::stream_protocol::socket socket, Hello hello)
      : socket_{std::move(socket)}, host_{std::move(hello)} {}

  [[nodiscard]] const Hello& host() const noexcept { return host_; }

  /// Sent when the io_context runs. A bridge that has gone is noticed by listen().
  void say(const Frame& frame);

  /// Hands on what comes, on the thread that runs the io_context.
  /// @param ended  nothing comes any more.
  void listen(std::function<void(Frame frame)> handler, std::function<void()> ended);

 private:
  void read_length();
  void send();

  boost::asio::local::stream_protocol::socket socket_;
  Hello host_;
  std::function<void(Frame frame)> handler_;
  std::function<void()> ended_;
  std::array<std::byte, length_bytes> length_{};
  std::vector<std::byte> body_;
  std::vector<std::byte> waiting_;
  std::vector<std::byte> sending_;
};

}  // namespace trestle::guest
