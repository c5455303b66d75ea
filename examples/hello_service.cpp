// Offers a service with two methods. Run examples/hello_client.cpp beside it.
#include <boost/asio/io_context.hpp>
#include <boost/asio/signal_set.hpp>
#include <cstdio>

#include <trestle/sd/net/handles.hpp>
#include <trestle/someip/net/address_text.hpp>

using namespace trestle::someip;
namespace sd = trestle::sd;

constexpr MethodId greet{1};
constexpr MethodId divide{2};

// hello_service [ADDRESS [GROUP]]
int main(int argc, char** argv) try {
  boost::asio::io_context io;
  sd::Node node{io,
                {.address = parse_address(argc > 1 ? argv[1] : "127.0.0.1").value(),
                 .multicast = parse_address(argc > 2 ? argv[2] : "224.244.224.245").value()}};

  const auto on_greet = [](const std::string& name) { return "Hello, " + name + "!"; };
  const auto on_divide = [](std::uint32_t a, std::uint32_t b) -> Result<std::uint32_t, ReturnCode> {
    if (b == 0) {
      return tl::unexpected{ReturnCode{0x21}};  // an error of this interface
    }
    return a / b;
  };
  const sd::Offer offer{node,
                        {.service = ServiceId{0x1234},
                         .instance = InstanceId{1},
                         .tcp_port = 0,  // beside UDP, which is there anyway
                         .methods = {{greet, sd::answering(on_greet)}, {divide, sd::answering(on_divide)}}}};

  boost::asio::signal_set stop{io, SIGINT, SIGTERM};
  stop.async_wait([&](auto, int) { io.stop(); });
  io.run();
} catch (const std::exception& error) {
  std::fprintf(stderr, "%s\n", error.what());
  return 1;
}
