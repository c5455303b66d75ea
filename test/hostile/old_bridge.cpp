#include "test/hostile/old_bridge.hpp"

#include <fmt/format.h>

#include <array>
#include <boost/asio/post.hpp>

#include "bridge/measure/report.hpp"
#include "dds_adapter/ros_names.hpp"
#include "someip/net/address_text.hpp"
#include "someip/wire/bytes.hpp"

namespace trestle::test {
namespace {

using measure::monotonic_ns;
using namespace std::chrono_literals;

constexpr someip::MethodId the_method{1};

/// A String as SOME/IP has it by default: length, byte order mark, and the rest as in CDR.
std::vector<std::byte> someip_string(ByteView cdr) {
  const ByteView text = cdr.size() > 8 ? cdr.subspan(8) : ByteView{};
  std::vector<std::byte> out(4 + 3 + text.size());
  someip::ByteWriter to{out};
  to.u32(static_cast<std::uint32_t>(3 + text.size()));
  to.u8(0xef);
  to.u8(0xbb);
  to.u8(0xbf);
  to.bytes(text);
  return out;
}

}  // namespace

OldBridge::OldBridge(boost::asio::io_context& io, Lines& lines, const std::string& address,
                     std::uint32_t domain)
    : io_{io},
      lines_{lines},
      node_{io, sd::NodeConfig{.address = someip::parse_address(address).value()},
            [](const std::string& line) { std::fprintf(stderr, "%s\n", line.c_str()); }},
      participant_{{.domain = domain, .name = "old_bridge", .interfaces = {}, .on_event = {}}},
      timer_{io} {
  work();
}

void OldBridge::add(const Part& part) {
  if (part.word(0) == "event") {
    event(part);
  } else if (part.word(0) == "method") {
    method(part);
  } else {
    throw std::invalid_argument{"no such part of an old bridge: " + part.word(0)};
  }
}

void OldBridge::event(const Part& part) {
  sd::ServiceSpec spec{.service = someip::ServiceId{part.id(2)}, .instance = someip::InstanceId{1}};
  spec.eventgroups = {{.id = the_eventgroup, .events = {the_event}}};
  const sd::OfferHandle offer = node_.offer(std::move(spec));
  readers_.push_back(participant_.create_reader(
      dds::ros_topic_name(part.word(1)), dds::ros_type_name("std_msgs/msg/String"), {.depth = 50},
      [this, offer, flow = part.flow](const dds::Sample& sample) {
        boost::asio::post(io_, [this, offer, flow, payload = someip_string(sample.cdr())] {
          lines_.add(fmt::format("S {} {}", flow, monotonic_ns()));
          const ByteView view{payload};
          node_.notify(offer, the_event, {&view, 1});
        });
      }));
}

void OldBridge::method(const Part& part) {
  clients_.push_back(std::make_unique<dds::ServiceClient>(
      participant_, dds::ServiceConfig{.name = part.word(2), .type = "std_srvs/srv/SetBool"},
      [this] { boost::asio::post(io_, [this] { work(); }); }));
  sd::ServiceSpec spec{.service = someip::ServiceId{part.id(1)}, .instance = someip::InstanceId{1}};
  spec.methods = {{.id = the_method,
                   .handler = [this, &client = *clients_.back(), flow = part.flow](
                                  const someip::Message& /*request*/, sd::Responder responder) {
                     lines_.add(fmt::format("Q {} {}", flow, monotonic_ns()));
                     const std::array<std::byte, 5> yes{std::byte{0}, std::byte{1}, std::byte{0},
                                                        std::byte{0}, std::byte{1}};
                     const ByteView view{yes};
                     const auto waiting = std::make_shared<sd::Responder>(std::move(responder));
                     client.call(
                         {&view, 1}, 5s, std::chrono::steady_clock::now(), [waiting](const auto& reply) {
                           // success, and an empty string
                           constexpr std::array<std::uint8_t, 9> answer{1, 0, 0, 0, 4, 0xef, 0xbb, 0xbf, 0};
                           if (reply) {
                             waiting->respond(std::as_bytes(std::span{answer}));
                           } else {
                             waiting->error(someip::ReturnCode::not_ok);
                           }
                         });
                   }}};
  node_.offer(std::move(spec));
}

// When a client asks for it, and for what it gives up, from time to time.
void OldBridge::work() {
  for (const auto& client : clients_) {
    client->work(std::chrono::steady_clock::now());
  }
  timer_.expires_after(10ms);
  timer_.async_wait([this](const boost::system::error_code& error) {
    if (!error) {
      work();
    }
  });
}

}  // namespace trestle::test
