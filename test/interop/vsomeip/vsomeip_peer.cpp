// The vsomeip side of the interoperability tests.
//   vsomeip_peer service   offers the service of service.hpp; reads the commands "withdraw" and "offer", and
//   reports
//                                      -> subscribed GROUP, unsubscribed GROUP
//   vsomeip_peer client    uses it; reads commands and reports what it sees, a line each:
//     call METHOD udp|tcp SIZE [INTERFACE_VERSION]
//                                      -> answer METHOD CODE SIZE CHECKSUM
//     tell udp|tcp SIZE
//     emit udp|tcp EVENT SIZE          -> answer ...
//     subscribe GROUP EVENT udp|tcp event|field|selective
//                                      -> acknowledged GROUP STATUS, which is 0 or why not
//     unsubscribe GROUP
//                                      -> event EVENT SIZE CHECKSUM
//                                      -> available, gone
// All numbers are decimal. It ends when its standard input does.
#include <cstdio>
#include <iostream>
#include <mutex>
#include <sstream>
#include <string>
#include <thread>
#include <vsomeip/vsomeip.hpp>

#include "test/interop/vsomeip/service.hpp"

namespace {

using namespace trestle::interop;

std::shared_ptr<vsomeip::application> app;
std::mutex printing;

template <typename... Parts>
void say(const Parts&... parts) {
  std::ostringstream line;
  ((line << parts << ' '), ...);
  const std::lock_guard guard{printing};
  std::cout << line.str() << std::endl;
}

std::shared_ptr<vsomeip::payload> payload_of(const std::vector<std::uint8_t>& bytes) {
  return vsomeip::runtime::get()->create_payload(bytes);
}

std::vector<std::uint8_t> bytes_of(const std::shared_ptr<vsomeip::payload>& payload) {
  return {payload->get_data(), payload->get_data() + payload->get_length()};
}

// --- the service ---

void respond(const std::shared_ptr<vsomeip::message>& request, const std::vector<std::uint8_t>& bytes) {
  const auto response = vsomeip::runtime::get()->create_response(request);
  response->set_payload(payload_of(bytes));
  app->send(response);
}

void notify(std::uint16_t event, const std::vector<std::uint8_t>& bytes) {
  app->notify(service, instance, event, payload_of(bytes), true);
}

void on_request(const std::shared_ptr<vsomeip::message>& request) {
  static std::vector<std::uint8_t> field{0x2a};
  const auto bytes = bytes_of(request->get_payload());
  switch (request->get_method()) {
    case echo:
      respond(request, bytes);
      break;
    case fail: {
      const auto response = vsomeip::runtime::get()->create_response(request);
      response->set_return_code(static_cast<vsomeip::return_code_e>(bytes.size()));
      app->send(response);
      break;
    }
    case tell:
      notify(event_udp, bytes);
      break;
    case emit: {
      respond(request, {});
      const std::uint32_t size = static_cast<std::uint32_t>(bytes.at(2)) << 24U |
                                 static_cast<std::uint32_t>(bytes.at(3)) << 16U |
                                 static_cast<std::uint32_t>(bytes.at(4)) << 8U | bytes.at(5);
      notify(static_cast<std::uint16_t>(bytes.at(0) << 8U | bytes.at(1)), pattern(size));
      break;
    }
    case getter:
      respond(request, field);
      break;
    case setter:
      field = bytes;
      respond(request, field);
      notify(notifier, field);
      break;
    default:
      break;
  }
}

void serve() {
  using vsomeip::event_type_e;
  using vsomeip::reliability_type_e;
  const auto event = [](std::uint16_t id, std::uint16_t group, event_type_e type,
                        reliability_type_e reliability) {
    app->offer_event(service, instance, id, {group}, type, std::chrono::milliseconds::zero(), false, true,
                     nullptr, reliability);
  };
  event(event_udp, group_udp, event_type_e::ET_EVENT, reliability_type_e::RT_UNRELIABLE);
  event(event_tcp, group_tcp, event_type_e::ET_EVENT, reliability_type_e::RT_RELIABLE);
  event(event_multicast, group_multicast, event_type_e::ET_EVENT, reliability_type_e::RT_UNRELIABLE);
  event(notifier, group_field, event_type_e::ET_FIELD, reliability_type_e::RT_UNRELIABLE);
  for (const std::uint16_t method : {echo, fail, tell, emit, getter, setter}) {
    app->register_message_handler(service, instance, method, on_request);
  }
  for (const std::uint16_t group : {group_udp, group_tcp, group_multicast, group_field}) {
    app->register_subscription_handler(
        service, instance, group,
        [group](vsomeip::client_t, const vsomeip_sec_client_t*, const std::string&, bool subscribed) {
          say(subscribed ? "subscribed" : "unsubscribed", group);
          return true;
        });
  }
  notify(notifier, {0x2a});
  app->offer_service(service, instance, major_version);
}

void obey_service(const std::string& command) {
  if (command == "withdraw") {
    app->stop_offer_service(service, instance, major_version);
  } else if (command == "offer") {
    app->offer_service(service, instance, major_version);
  }
}

// --- the client ---

void on_message(const std::shared_ptr<vsomeip::message>& message) {
  const auto bytes = bytes_of(message->get_payload());
  const std::uint32_t sum = checksum(bytes.data(), bytes.size());
  if (message->get_message_type() == vsomeip::message_type_e::MT_NOTIFICATION) {
    say("event", message->get_method(), bytes.size(), sum);
  } else {
    say("answer", message->get_method(), static_cast<int>(message->get_return_code()), bytes.size(), sum);
  }
}

void on_availability(vsomeip::service_t /*service*/, vsomeip::instance_t /*instance*/, bool available) {
  static bool before = false;  // it begins by saying that the service is not there
  if (available != before) {
    say(available ? "available" : "gone");
  }
  before = available;
}

void use() {
  app->register_availability_handler(service, instance, on_availability, major_version);
  app->register_message_handler(service, instance, vsomeip::ANY_METHOD, on_message);
  app->request_service(service, instance, major_version);
}

void send(std::uint16_t method, const std::string& transport, const std::vector<std::uint8_t>& bytes,
          bool answered, int version = major_version) {
  const auto request = vsomeip::runtime::get()->create_request(transport == "tcp");
  request->set_service(service);
  request->set_instance(instance);
  request->set_method(method);
  request->set_interface_version(static_cast<std::uint8_t>(version));
  if (!answered) {
    request->set_message_type(vsomeip::message_type_e::MT_REQUEST_NO_RETURN);
  }
  request->set_payload(payload_of(bytes));
  app->send(request);
}

void obey_client(const std::string& line) {
  std::istringstream words{line};
  std::string command;
  std::string transport;
  std::uint16_t id = 0;
  std::uint32_t size = 0;
  words >> command;
  if (command == "call" && words >> id >> transport >> size) {
    int version = major_version;
    if (!(words >> version)) {
      version = major_version;
    }
    send(id, transport, pattern(size), true, version);
  } else if (command == "tell" && words >> transport >> size) {
    send(tell, transport, pattern(size), false);
  } else if (command == "emit" && words >> transport >> id >> size) {
    std::vector<std::uint8_t> bytes;
    for (const unsigned shift : {8U, 0U}) {
      bytes.push_back(static_cast<std::uint8_t>(id >> shift));
    }
    for (const unsigned shift : {24U, 16U, 8U, 0U}) {
      bytes.push_back(static_cast<std::uint8_t>(size >> shift));
    }
    send(emit, transport, bytes, true);
  } else if (std::uint16_t event = 0; command == "subscribe" && words >> id >> event >> transport) {
    std::string kind;
    words >> kind;
    app->register_subscription_status_handler(
        service, instance, id, event,
        [](vsomeip::service_t, vsomeip::instance_t, vsomeip::eventgroup_t group, vsomeip::event_t,
           std::uint16_t status) { say("acknowledged", group, status); },
        kind == "selective");
    app->request_event(service, instance, event, {id},
                       kind == "field"       ? vsomeip::event_type_e::ET_FIELD
                       : kind == "selective" ? vsomeip::event_type_e::ET_SELECTIVE_EVENT
                                             : vsomeip::event_type_e::ET_EVENT,
                       transport == "tcp" ? vsomeip::reliability_type_e::RT_RELIABLE
                                          : vsomeip::reliability_type_e::RT_UNRELIABLE);
    app->subscribe(service, instance, id, major_version);
  } else if (command == "unsubscribe" && words >> id) {
    app->unsubscribe(service, instance, id);
  }
}

}  // namespace

int main(int argc, char** argv) {
  const std::string role = argc == 2 ? argv[1] : "";
  if (role != "service" && role != "client") {
    std::fprintf(stderr, "usage: vsomeip_peer service|client\n");
    return 2;
  }
  app = vsomeip::runtime::get()->create_application("peer");
  if (!app || !app->init()) {
    return 1;
  }
  app->register_state_handler([&](vsomeip::state_type_e state) {
    if (state == vsomeip::state_type_e::ST_REGISTERED) {
      role == "service" ? serve() : use();
      say("ready");
    }
  });
  std::thread commands{[&] {
    for (std::string line; std::getline(std::cin, line);) {
      role == "service" ? obey_service(line) : obey_client(line);
    }
    app->stop();
  }};
  app->start();
  commands.join();
}
