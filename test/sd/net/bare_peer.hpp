#pragma once
#include <boost/asio/ip/tcp.hpp>
#include <deque>

#include "someip/net/address_text.hpp"
#include "someip/net/udp_socket.hpp"
#include "test/bytes.hpp"
#include "test/sd/net/two_nodes.hpp"

namespace trestle::test {

/// A peer of bare sockets that speaks SD as it is told and accepts TCP connections.
class BarePeer : public TwoNodes {
 protected:
  static constexpr std::uint16_t sd_port = 30490;
  static constexpr std::uint16_t tcp_port = 40230;

  void SetUp() override {
    socket.receive([this](ByteView datagram, const Endpoint&) {
      if (datagram.size() > 24) {
        received.push_back(to_hex(datagram));
      }
    });
    accept();
  }
  void accept() {
    connections.emplace_back(io);
    acceptor.async_accept(connections.back(), [this](const boost::system::error_code& error) {
      if (!error) {
        ++accepted;
        accept();
      }
    });
  }
  /// Multicasts entries that all refer to our endpoint at port 40230. No "explicit initial data" flag.
  /// @param protocol  "06": TCP, "11": UDP.
  void send(const std::string& entries, const std::string& protocol = "06") {
    const auto address = to_hex(std::as_bytes(std::span{other_address.bytes})).substr(0, 8);
    send({own_group(), sd_port}, session++, entries, "0009 04 00" + address + "00" + protocol + "9d26");
  }
  /// Tells the node at client_address alone.
  void answer(const std::string& entry, const std::string& options = "") {
    send({client_address, sd_port}, answer_session++, entry, options);
  }
  void send(const Endpoint& to, std::size_t with_session, const std::string& entries,
            const std::string& options) {
    const std::size_t entry_bytes = hex(entries).size();
    const std::size_t option_bytes = hex(options).size();
    const auto number = [](std::size_t value, std::size_t digits) {
      std::string text(digits, '0');
      for (std::size_t i = digits; i-- > 0; value /= 16) {
        text[i] = "0123456789abcdef"[value % 16];
      }
      return text;
    };
    const auto message =
        hex("ffff 8100" + number(20 + entry_bytes + option_bytes, 8) + "0000" + number(with_session, 4) +
            "01 01 02 00 c0 000000" + number(entry_bytes, 8) + entries + number(option_bytes, 8) + options);
    const ByteView bytes{message};
    ASSERT_EQ(socket.send(to, {&bytes, 1}), someip::SendStatus::sent);
  }
  /// How many messages hold an entry that begins so.
  [[nodiscard]] std::size_t count(const std::string& entry) const {
    return static_cast<std::size_t>(std::ranges::count_if(
        received, [&](const std::string& one) { return one.find(entry) != std::string::npos; }));
  }

  static constexpr const char* offer = "01 00 00 10 1234 0001 01 000258 00000000";
  static constexpr const char* stop = "01 00 00 10 1234 0001 01 000000 00000000";
  someip::UdpSocket socket{io,
                           {.local = {other_address, sd_port},
                            .interface = someip::MulticastInterface{other_address},
                            .sharing = someip::PortSharing::by_address}};
  boost::asio::ip::tcp::acceptor acceptor{
      io, {boost::asio::ip::make_address(someip::to_string(other_address)), tcp_port}};
  std::deque<boost::asio::ip::tcp::socket> connections;
  std::size_t accepted = 0;
  std::vector<std::string> received;
  std::size_t session = 1;
  std::size_t answer_session = 1;
  const sd::SubscribeSpec wanted{.service = sd::ServiceId{0x1234},
                                 .instance = sd::InstanceId{1},
                                 .eventgroup = sd::EventgroupId{1},
                                 .events = {someip::MethodId{0x8001}},
                                 .udp = false,
                                 .tcp = true};
};

}  // namespace trestle::test
