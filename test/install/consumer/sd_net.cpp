#include <boost/asio/io_context.hpp>

#include <trestle/sd/net/handles.hpp>

int main() {
  boost::asio::io_context io{1};
  try {
    const trestle::sd::Node node{io, {.address = {}}};  // no address at all
  } catch (const std::exception&) {
    return 0;
  }
  return 1;
}
