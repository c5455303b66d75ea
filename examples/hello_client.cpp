// Calls the methods of examples/hello_service.cpp: with a callback, and from another thread with a
// std::future.
#include <boost/asio/io_context.hpp>
#include <boost/asio/use_future.hpp>
#include <cstdio>
#include <thread>

#include <trestle/sd/net/proxy.hpp>
#include <trestle/someip/net/address_text.hpp>

using namespace trestle::someip;
using namespace std::chrono_literals;
namespace sd = trestle::sd;

constexpr MethodId greet{1};
constexpr MethodId divide{2};

// hello_client [ADDRESS [GROUP]]
int main(int argc, char** argv) try {
  boost::asio::io_context io;
  sd::Node node{io,
                {.address = parse_address(argc > 1 ? argv[1] : "127.0.0.2").value(),
                 .multicast = parse_address(argc > 2 ? argv[2] : "224.244.224.245").value()}};
  sd::Proxy hello{node, {.service = ServiceId{0x1234}}};

  // Waits until the service is there, for 5 s unless it says otherwise.
  hello.call({.method = greet}, pack("world"), [&](auto error, const sd::Response& response) {
    if (error) {
      std::printf("no greeting: %s\n", error.message().c_str());
    } else if (const auto greeting = unpack<std::string>(response.payload)) {
      std::printf("%s\n", greeting->c_str());
    }
    io.stop();
  });
  io.run();

  // The same from a thread that may wait, while another one runs the io_context.
  io.restart();
  std::jthread network{[&] { io.run(); }};
  for (const std::uint32_t by : {6U, 0U}) {
    try {
      auto answer = hello.call({.method = divide, .timeout = 2s, .transport = trestle::Transport::tcp},
                               pack(std::uint32_t{42}, by), boost::asio::use_future);
      std::printf("42 / %u = %u\n", by, unpack<std::uint32_t>(answer.get().payload).value());
    } catch (const std::exception& error) {
      std::printf("42 / %u: %s\n", by, error.what());
    }
  }
  io.stop();
} catch (const std::exception& error) {
  std::fprintf(stderr, "%s\n", error.what());
  return 1;
}
