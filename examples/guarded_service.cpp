// Offers a service that only some hosts may use; with the argument "tls", over TCP that is encrypted.
#include <boost/asio/io_context.hpp>
#include <boost/asio/signal_set.hpp>
#include <cstdio>
#include <string_view>

#include <trestle/sd/net/handles.hpp>
#include <trestle/someip/net/address_text.hpp>

using namespace trestle::someip;
namespace sd = trestle::sd;

// guarded_service [ADDRESS [GROUP [tls]]]
int main(int argc, char** argv) try {
  boost::asio::io_context io;
  sd::NodeConfig config{.address = parse_address(argc > 1 ? argv[1] : "192.168.10.1").value(),
                        .multicast = parse_address(argc > 2 ? argv[2] : "224.244.224.245").value()};
  config.access = {.peers = {*sd::parse_subnet("192.168.10.0/24")},
                   .policies = {{.rules = {{.allow = {sd::Access::call},
                                            .first_service = ServiceId{0x1234},
                                            .last_service = ServiceId{0x1234},
                                            .methods = {MethodId{7}},
                                            .peers = {*sd::parse_subnet("192.168.10.20")}}}}}};
  const bool encrypted = argc > 3 && std::string_view{argv[3]} == "tls";
  if (encrypted) {
    if (!has_tls()) {
      std::fputs("this build of Trestle has no TLS\n", stderr);
      return 1;
    }
    config.tls = {.certificate_file = "node.pem", .key_file = "node.key", .ca_file = "roots.pem"};
  }
  sd::Node node{io, config};

  const auto on_greet = [](const std::string& name) { return "Hello, " + name + "!"; };
  sd::ServiceSpec service{.service = ServiceId{0x1234},
                          .instance = InstanceId{1},
                          .tcp_port = 0,
                          .methods = {{MethodId{1}, sd::answering(on_greet)},  // for all of the subnet
                                      {MethodId{7}, sd::answering(on_greet)}}};
  if (encrypted) {
    service.udp_port = {};  // UDP is not protected
  }
  const sd::Offer offer{node, service};

  boost::asio::signal_set stop{io, SIGINT, SIGTERM};
  stop.async_wait([&](auto, int) { io.stop(); });
  io.run();
} catch (const std::exception& error) {
  std::fprintf(stderr, "%s\n", error.what());
  return 1;
}
