// Sends a megabyte there and back, over UDP in segments (SOME/IP-TP) and over TCP. Two nodes in one program.
#include <boost/asio/io_context.hpp>
#include <cstdio>

#include <trestle/sd/net/handles.hpp>
#include <trestle/sd/net/proxy.hpp>
#include <trestle/someip/net/address_text.hpp>

using namespace trestle::someip;
namespace sd = trestle::sd;
using trestle::Transport;

// large_message [SERVER_ADDRESS CLIENT_ADDRESS [GROUP]]
int main(int argc, char** argv) try {
  boost::asio::io_context io;
  const auto group = parse_address(argc > 3 ? argv[3] : "224.244.224.245").value();
  sd::Node server{io,
                  {.address = parse_address(argc > 2 ? argv[1] : "127.0.0.1").value(), .multicast = group}};
  sd::Node client{io,
                  {.address = parse_address(argc > 2 ? argv[2] : "127.0.0.2").value(),
                   .multicast = group,
                   .max_message_bytes = std::size_t{4} << 20U}};  // the most that others may make it store

  // This one takes bytes as they are.
  const auto echo = [](const Message& request, sd::Responder responder) {
    responder.respond(request.payload);  // now; or later, if it is kept
  };
  const sd::Offer offer{server,
                        {.service = ServiceId{0x4567},
                         .instance = InstanceId{1},
                         .tcp_port = 0,
                         .methods = {{MethodId{1}, echo}}}};

  const std::vector<std::byte> megabyte(std::size_t{1} << 20U, std::byte{0x5a});
  sd::Proxy proxy{client, {.service = ServiceId{0x4567}}};
  int waiting = 2;
  for (const Transport transport : {Transport::udp, Transport::tcp}) {
    proxy.call({.method = MethodId{1}, .transport = transport}, trestle::ByteView{megabyte},
               [&, transport](auto error, const sd::Response& response) {
                 std::printf("%s: %s\n", transport == Transport::udp ? "UDP" : "TCP",
                             error                          ? error.message().c_str()
                             : response.payload == megabyte ? "1048576 bytes came back"
                                                            : "other bytes came back");
                 if (--waiting == 0) {
                   io.stop();
                 }
               });
  }
  io.run();
  std::printf("segments received by the client: %llu\n",
              static_cast<unsigned long long>(client.reassembly_counters().segments));
} catch (const std::exception& error) {
  std::fprintf(stderr, "%s\n", error.what());
  return 1;
}
