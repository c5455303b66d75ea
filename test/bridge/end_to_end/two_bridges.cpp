#include "test/bridge/end_to_end/two_bridges.hpp"

#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include <boost/asio/io_context.hpp>
#include <boost/asio/post.hpp>
#include <future>

#include "bridge/carry/config/load.hpp"
#include "bridge/messages/types/type_library.hpp"
#include "someip/net/address_text.hpp"
#include "test/loopback.hpp"

namespace trestle::test {

struct RunningBridge::State {
  explicit State(const std::string& yaml) : config{load(yaml)} {
    bridge = std::make_unique<carry::Bridge>(io, config, types, report);
    thread = std::thread{[this] { io.run(); }};
  }
  static carry::BridgeConfig load(const std::string& yaml) {
    const auto loaded = carry::parse_config(yaml, "test.yaml");
    if (!loaded) {
      throw std::runtime_error{to_string(loaded.error().front())};
    }
    return loaded->config;
  }

  boost::asio::io_context io{1};
  carry::BridgeConfig config;
  messages::TypeLibrary types = messages::TypeLibrary::in(config.types);
  carry::Report report;
  std::unique_ptr<carry::Bridge> bridge;
  std::thread thread;
};

RunningBridge::RunningBridge(const std::string& yaml) : state_{std::make_unique<State>(yaml)} {}

RunningBridge::~RunningBridge() {
  boost::asio::post(state_->io, [this] {
    state_->bridge->stop();
    state_->io.stop();
  });
  state_->thread.join();
}

namespace {

std::uint64_t counter_of(const std::vector<carry::CounterGroup>& groups, const std::string& group,
                         const std::string& name) {
  for (const carry::CounterGroup& one : groups) {
    for (const carry::Counter& counter : one.counters) {
      if (one.name.starts_with(group) && counter.name == name) {
        return counter.count;
      }
    }
  }
  throw std::logic_error{"no counter " + name + " of " + group};
}

}  // namespace

std::promise<void> RunningBridge::busy() {
  std::promise<void> over;
  boost::asio::post(state_->io, [is_over = over.get_future()] { is_over.wait(); });
  return over;
}

std::thread::id RunningBridge::thread() const {
  return state_->thread.get_id();
}

std::vector<carry::CounterGroup> RunningBridge::counters() {
  std::promise<std::vector<carry::CounterGroup>> result;
  boost::asio::post(state_->io, [&] { result.set_value(state_->bridge->counters()); });
  return result.get_future().get();
}

std::uint64_t RunningBridge::counter(const std::string& group, const std::string& name) {
  return counter_of(counters(), group, name);
}

std::string bridge_head(std::uint8_t host, std::uint32_t domain) {
  return fmt::format(
      "someip:\n"
      "  address: {}\n"
      "  sd: {{multicast: {}, initial_delay_min: 0, initial_delay_max: 5 ms, cyclic_offer_delay: 100 ms, "
      "ttl: 600 s}}\n"
      "  limits: {{tcp_dead_after: 600 s}}\n"  // a test may take its time until it reads
      "dds: {{domain: {}, interfaces: [127.0.0.1]}}\n",
      someip::to_string(own_address(host)), someip::to_string(own_group()), domain);
}

std::string TwoBridges::yaml(bool end_a, const std::vector<TestRoute>& routes,
                             const std::string& types_folder) const {
  std::string text = end_a ? bridge_head(1, domain_.id()) : bridge_head(2, domain_b_.id());
  text += types_folder.empty() ? "" : "types: {paths: [" + types_folder + "]}\n";
  text += "routes:\n";
  for (std::size_t i = 0; i < routes.size(); ++i) {
    const TestRoute& route = routes[i];
    const bool outbound = route.from_a_to_b == end_a;
    text += fmt::format(
        "  - topic: {}\n    type: {}\n    direction: {}\n    service: {}\n    instance: 1\n    eventgroup: "
        "1\n"
        "    event: {}\n{}{}",
        route.topic, route.type, outbound ? "dds_to_someip" : "someip_to_dds",
        0x1000 + (one_service_ ? 0 : i), 0x8001 + i,
        outbound ? fmt::format("    port: {}\n", 40001 + (one_service_ ? 0 : i)) : "",
        outbound ? route.settings + route.server_settings : route.settings);
  }
  return text;
}

void TwoBridges::start(const std::vector<TestRoute>& routes, const std::string& types_folder) {
  spdlog::set_level(spdlog::level::warn);
  a_ = std::make_unique<RunningBridge>(yaml(true, routes, types_folder));
  b_ = std::make_unique<RunningBridge>(yaml(false, routes, types_folder));
}

dds::Participant TwoBridges::participant(std::uint32_t domain) const {
  dds::ParticipantConfig settings = config();
  settings.domain = domain;
  return dds::Participant{settings};
}

}  // namespace trestle::test
