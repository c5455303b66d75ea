// A thermostat: a field that others read, set and subscribe to. Server and client, here in one program.
#include <algorithm>
#include <boost/asio/io_context.hpp>
#include <cstdio>

#include <trestle/sd/net/handles.hpp>
#include <trestle/sd/net/proxy.hpp>
#include <trestle/someip/net/address_text.hpp>

using namespace trestle::someip;
namespace sd = trestle::sd;

constexpr MethodId get_target{0x0001};
constexpr MethodId set_target{0x0002};
constexpr MethodId target_changed{0x8001};

// field [SERVER_ADDRESS CLIENT_ADDRESS [GROUP]]
int main(int argc, char** argv) try {
  boost::asio::io_context io;
  const auto group = parse_address(argc > 3 ? argv[3] : "224.244.224.245").value();
  sd::Node server{io,
                  {.address = parse_address(argc > 2 ? argv[1] : "127.0.0.1").value(), .multicast = group}};
  sd::Node client{io,
                  {.address = parse_address(argc > 2 ? argv[2] : "127.0.0.2").value(), .multicast = group}};

  // The Node keeps the value, answers the getter and notifies subscribers. New values are checked here:
  const auto within_limits = [](double wanted) -> Result<double, ReturnCode> {
    if (wanted < 0) {
      return tl::unexpected{ReturnCode::not_ok};
    }
    return std::min(wanted, 30.0);
  };
  const sd::Offer thermostat{server,
                             {.service = ServiceId{0x3456},
                              .instance = InstanceId{1},
                              .fields = {{.getter = get_target,
                                          .setter = set_target,
                                          .notifier = target_changed,
                                          .value = pack(20.0),
                                          .on_set = typed(within_limits)}},
                              .eventgroups = {{.id = EventgroupId{1}, .events = {target_changed}}}}};

  sd::Proxy proxy{client, {.service = ServiceId{0x3456}}};
  bool begun = false;
  const auto begin = [&] {
    begun = true;
    proxy.call({.method = set_target}, pack(99.0), [&](auto error, const sd::Response& response) {
      std::printf("set: %s, %.1f\n", error.message().c_str(), unpack<double>(response.payload).value_or(0));
      proxy.call({.method = set_target}, pack(-5.0), [&](auto refused, const sd::Response&) {
        std::printf("set: %s\n", refused.message().c_str());
        thermostat.set(target_changed, pack(18.5));  // by the server itself
      });
    });
  };
  const sd::Subscription subscription{
      client,
      {.service = ServiceId{0x3456}, .eventgroup = EventgroupId{1}, .events = {target_changed}},
      [&](const Message& event, const trestle::Endpoint&) {
        const double target = unpack<double>(event.payload).value_or(0);
        std::printf("target is %.1f\n", target);
        if (!begun) {  // the value that a new subscriber gets
          begin();
        } else if (target == 18.5) {
          io.stop();
        }
      }};
  io.run();
} catch (const std::exception& error) {
  std::fprintf(stderr, "%s\n", error.what());
  return 1;
}
