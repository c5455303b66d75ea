// A device of vsomeip for `trestle conform`: an echo, also of large messages in segments, a field, cyclic
// events over UDP, TCP and multicast. It writes its configuration into a folder of its own. vsomeip_device
// ADDRESS; ends in order by SIGTERM.
#include <pthread.h>
#include <stdlib.h>

#include <atomic>
#include <chrono>
#include <csignal>
#include <cstdint>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <memory>
#include <string>
#include <thread>
#include <vector>
#include <vsomeip/vsomeip.hpp>

namespace {

using namespace std::chrono_literals;
using Bytes = std::vector<std::uint8_t>;

constexpr vsomeip::service_t service = 0x1234;
constexpr vsomeip::instance_t instance = 1;
constexpr vsomeip::method_t echo = 0x0001;
constexpr vsomeip::method_t fire_and_forget = 0x0002;
constexpr vsomeip::method_t getter = 0x0010;
constexpr vsomeip::method_t setter = 0x0011;
constexpr vsomeip::event_t event_udp = 0x8001;
constexpr vsomeip::event_t event_multicast = 0x8003;
constexpr vsomeip::event_t event_tcp = 0x8004;
constexpr vsomeip::event_t notifier = 0x8010;

std::shared_ptr<vsomeip::application> app;

std::shared_ptr<vsomeip::payload> payload_of(const Bytes& bytes) {
  return vsomeip::runtime::get()->create_payload(bytes);
}

std::string configuration(const std::string& address) {
  return R"({"unicast": ")" + address + R"(",
    "logging": {"level": "warning", "console": "true"},
    "applications": [{"name": "device", "id": "0x1277"}],
    "routing": "device",
    "services": [{"service": "0x1234", "instance": "0x0001", "unreliable": "30501",
      "reliable": {"port": "30501", "enable-magic-cookies": "false"},
      "someip-tp": {"client-to-service": ["0x0001"], "service-to-client": ["0x0001"]},
      "events": [{"event": "0x8001", "is_reliable": "false"}, {"event": "0x8003", "is_reliable": "false"},
                 {"event": "0x8004", "is_reliable": "true"},
                 {"event": "0x8010", "is_field": "true", "is_reliable": "false"}],
      "eventgroups": [{"eventgroup": "0x0001", "events": ["0x8001"]}, {"eventgroup": "0x0002", "events": ["0x8010"]},
                      {"eventgroup": "0x0003", "events": ["0x8003"], "threshold": "1",
                       "multicast": {"address": "224.225.226.233", "port": "32344"}},
                      {"eventgroup": "0x0004", "events": ["0x8004"]}]}],
    "service-discovery": {"enable": "true", "multicast": "224.244.224.245", "port": "30490", "protocol": "udp",
      "initial_delay_min": "10", "initial_delay_max": "50", "repetitions_base_delay": "50", "repetitions_max": "3",
      "ttl": "3", "cyclic_offer_delay": "1000", "request_response_delay": "50"}})";
}

void on_request(const std::shared_ptr<vsomeip::message>& request) {
  static Bytes field{0x2a};
  const auto payload = request->get_payload();
  const Bytes bytes{payload->get_data(), payload->get_data() + payload->get_length()};
  const bool sets = request->get_method() == setter && bytes.size() == 1;
  if (sets) {
    field = bytes;
  }
  if (request->get_message_type() == vsomeip::message_type_e::MT_REQUEST &&
      request->get_method() != fire_and_forget) {
    const auto response = vsomeip::runtime::get()->create_response(request);
    response->set_payload(payload_of(request->get_method() == echo ? bytes : field));
    app->send(response);
  }
  if (sets) {
    app->notify(service, instance, notifier, payload_of(field), true);
  }
}

void serve() {
  using vsomeip::event_type_e;
  using vsomeip::reliability_type_e;
  const auto offer = [](vsomeip::event_t id, vsomeip::eventgroup_t group, event_type_e type,
                        reliability_type_e reliability) {
    // Without "update on change" vsomeip sends an event once only.
    app->offer_event(service, instance, id, {group}, type, 0ms, false, true, nullptr, reliability);
  };
  offer(event_udp, 1, event_type_e::ET_EVENT, reliability_type_e::RT_UNRELIABLE);
  offer(notifier, 2, event_type_e::ET_FIELD, reliability_type_e::RT_UNRELIABLE);
  offer(event_multicast, 3, event_type_e::ET_EVENT, reliability_type_e::RT_UNRELIABLE);
  offer(event_tcp, 4, event_type_e::ET_EVENT, reliability_type_e::RT_RELIABLE);
  for (const vsomeip::method_t method : {echo, fire_and_forget, getter, setter}) {
    app->register_message_handler(service, instance, method, on_request);
  }
  app->notify(service, instance, notifier, payload_of({0x2a}), true);
  app->offer_service(service, instance, 1, 0);
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 2) {
    std::fprintf(stderr, "usage: vsomeip_device ADDRESS\n");
    return 2;
  }
  sigset_t ends{};
  sigemptyset(&ends);
  sigaddset(&ends, SIGTERM);
  pthread_sigmask(SIG_BLOCK, &ends, nullptr);  // in all threads that vsomeip starts, too
  std::string folder = (std::filesystem::temp_directory_path() / "vsomeip_device_XXXXXX").string();
  if (mkdtemp(folder.data()) == nullptr) {
    std::perror("mkdtemp");
    return 1;
  }
  const std::string file = folder + "/vsomeip.json";
  std::ofstream{file} << configuration(argv[1]);
  setenv("VSOMEIP_CONFIGURATION", file.c_str(), 1);
  setenv("VSOMEIP_BASE_PATH", folder.c_str(), 1);
  app = vsomeip::runtime::get()->create_application("device");
  if (!app || !app->init()) {
    return 1;
  }
  app->register_state_handler([](vsomeip::state_type_e state) {
    if (state == vsomeip::state_type_e::ST_REGISTERED) {
      serve();
    }
  });
  std::atomic<bool> ended{false};
  std::thread events{[&] {
    while (!ended) {
      for (const vsomeip::event_t event : {event_udp, event_multicast, event_tcp}) {
        app->notify(service, instance, event, payload_of({1, 2}), true);
      }
      std::this_thread::sleep_for(200ms);
    }
  }};
  std::thread stopper{[&] {
    int number = 0;
    sigwait(&ends, &number);
    ended = true;
    app->stop_offer_service(service, instance, 1, 0);
    std::this_thread::sleep_for(100ms);  // until its StopOffer has gone
    app->stop();
  }};
  app->start();
  stopper.join();
  events.join();
  std::filesystem::remove_all(folder);
}
