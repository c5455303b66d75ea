// vsomeip_door: the door of examples/door as an application of vsomeip, with the configuration that `trestle
// generate --to vsomeip` makes of its description. Payloads are put together by hand, byte by byte. It prints
// "ready", and ends when its standard input does.
#include <cstdint>
#include <iostream>
#include <string>
#include <thread>
#include <vector>
#include <vsomeip/vsomeip.hpp>

namespace {

using Bytes = std::vector<std::uint8_t>;

constexpr vsomeip::service_t door = 0x4711;
constexpr vsomeip::instance_t instance = 1;
constexpr vsomeip::method_t open_method = 0x0010;
constexpr vsomeip::method_t label_getter = 0x0002;
constexpr vsomeip::method_t label_setter = 0x0003;
constexpr vsomeip::event_t label_notifier = 0x8002;

std::shared_ptr<vsomeip::application> app;

void respond(const std::shared_ptr<vsomeip::message>& request, const Bytes& bytes) {
  const auto response = vsomeip::runtime::get()->create_response(request);
  response->set_payload(vsomeip::runtime::get()->create_payload(bytes));
  app->send(response);
}

void notify(vsomeip::event_t event, const Bytes& bytes) {
  app->notify(door, instance, event, vsomeip::runtime::get()->create_payload(bytes), true);
}

// Length of 32 bits, BOM, text, end.
Bytes label{0, 0, 0, 8, 0xef, 0xbb, 0xbf, 'P', 'u', 's', 'h', 0};

void on_request(const std::shared_ptr<vsomeip::message>& request) {
  const auto payload = request->get_payload();
  const Bytes bytes{payload->get_data(), payload->get_data() + payload->get_length()};
  switch (request->get_method()) {
    case open_method: {  // Speed speed, UInt8 opening -> DoorError error, Boolean done
      const bool is_good = bytes.size() == 2 && bytes[0] <= 1 && bytes[1] <= 100;
      respond(request, {static_cast<std::uint8_t>(is_good ? 0 : 1), static_cast<std::uint8_t>(is_good)});
      break;
    }
    case label_setter:
      label = bytes;
      notify(label_notifier, label);
      [[fallthrough]];
    case label_getter:
      respond(request, label);
      break;
    default:
      break;
  }
}

void serve() {
  app->offer_event(door, instance, label_notifier, {1}, vsomeip::event_type_e::ET_FIELD,
                   std::chrono::milliseconds::zero(), false, true, nullptr,
                   vsomeip::reliability_type_e::RT_UNRELIABLE);
  for (const vsomeip::method_t method : {open_method, label_getter, label_setter}) {
    app->register_message_handler(door, instance, method, on_request);
  }
  notify(label_notifier, label);
  app->offer_service(door, instance, 1);
  std::cout << "ready" << std::endl;
}

}  // namespace

int main() {
  app = vsomeip::runtime::get()->create_application("trestle-service");
  if (!app || !app->init()) {
    return 1;
  }
  app->register_state_handler([](vsomeip::state_type_e state) {
    if (state == vsomeip::state_type_e::ST_REGISTERED) {
      serve();
    }
  });
  std::thread end{[] {
    for (std::string line; std::getline(std::cin, line);) {
    }
    app->stop();
  }};
  app->start();
  end.join();
}
