#include "bridge/conform/replay/replay.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "bridge/conform/cases/all_cases.hpp"
#include "bridge/conform/stimulus.hpp"

namespace trestle::conform::replay_test {
namespace {

using testing::ElementsAre;
using testing::IsEmpty;
using namespace std::chrono_literals;

const Endpoint server_sd{IpAddress::v4(192, 0, 2, 1), 30490};
const Endpoint client_sd{IpAddress::v4(192, 0, 2, 2), 30490};
const Endpoint group{IpAddress::v4(224, 244, 224, 245), 30490};
const Endpoint server{server_sd.address, 30501};
const Endpoint client{client_sd.address, 40001};

/// A capture, frame by frame.
class Capture {
 public:
  /// @param copies_after  each frame is there again, so much later.
  explicit Capture(std::optional<std::chrono::milliseconds> copies_after = {}) : copies_after_{copies_after} {
    replay_.begin(
        "", [](Transport, const Endpoint&) {}, copies_after.has_value());
  }

  /// A message on a TCP connection, so many seconds after the frame before.
  Capture& add_tcp(const Bytes& bytes, const Endpoint& from, const Endpoint& to, std::uint64_t later_s = 1) {
    frame_ += later_s;
    const auto message = someip::decode(ByteView{bytes});
    EXPECT_TRUE(message);
    replay_.message({.frame = frame_,
                     .time = pcaps::Timestamp{frame_ * 1s},
                     .flow = {from, to},
                     .transport = Transport::tcp},
                    0, *message);
    return *this;
  }

  Capture& add(const Bytes& bytes, const Endpoint& from, const Endpoint& to) {
    ++frame_;
    replay_.datagram({.frame = frame_,
                      .time = pcaps::Timestamp{frame_ * 1s},
                      .flow = {from, to},
                      .transport = Transport::udp},
                     bytes);
    if (copies_after_) {
      const std::uint64_t first = frame_++;
      replay_.datagram({.frame = frame_,
                        .time = pcaps::Timestamp{first * 1s} + *copies_after_,
                        .flow = {from, to},
                        .transport = Transport::udp},
                       bytes);
    }
    return *this;
  }
  /// The ids of the rules that are broken.
  std::vector<std::string> broken() {
    replay_.end();
    std::vector<std::string> ids;
    for (const CaseResult& one : replay_.results("")) {
      if (!one.outcome.differences.empty()) {
        ids.push_back(one.what->id.substr(5));
      }
    }
    return ids;
  }

 private:
  Replay replay_;
  std::optional<std::chrono::milliseconds> copies_after_;
  std::uint64_t frame_ = 0;
};

Call request() {
  return {.service = someip::ServiceId{0x1234},
          .method = someip::MethodId{1},
          .payload = bytes({1}),
          .session = someip::SessionId{1}};
}
Call response() {
  Call call = request();
  call.type = someip::MessageType::response;
  return call;
}
std::vector<std::string> broken_by(const Call& call) {
  return Capture{}.add(call.encode(), client, server).broken();
}

Bytes sd(const SdStimulus& stimulus, std::uint16_t session = 1, bool reboot = true) {
  return stimulus.encode(someip::SessionId{session}, reboot);
}
sd::Entry entry(trestle::sd::EntryType type, std::uint8_t options, std::uint32_t tail = 0) {
  return {.type = type,
          .first_run = {.index = 0, .count = options},
          .service = someip::ServiceId{0x1234},
          .instance = someip::InstanceId{1},
          .major = 1,
          .ttl_s = 5,
          .tail = tail};
}
SdStimulus offer() {
  return {.entries = {entry(trestle::sd::EntryType::offer_service, 1)},
          .options = {endpoint_option(server, Transport::udp)},
          .flags = trestle::sd::unicast_flag};
}
SdStimulus subscribe() {
  return {.entries = {entry(trestle::sd::EntryType::subscribe_eventgroup, 1, 2)},
          .options = {endpoint_option(client, Transport::udp)},
          .flags = trestle::sd::unicast_flag};
}
SdStimulus ack() {
  return {.entries = {entry(trestle::sd::EntryType::subscribe_eventgroup_ack, 0, 2)},
          .flags = trestle::sd::unicast_flag};
}
std::vector<std::string> broken_by(const SdStimulus& stimulus) {
  return Capture{}.add(sd(stimulus), server_sd, group).broken();
}

Bytes segment(std::uint32_t word, std::size_t size, std::uint8_t version = 1, std::uint16_t session = 1) {
  Call call = request();
  call.type = someip::MessageType::tp_request;
  call.interface_version = version;
  call.payload.clear();
  append_u32(call.payload, word);
  call.payload.resize(4 + size);
  call.session = someip::SessionId{session};
  Bytes all = call.encode();
  someip::store<std::uint16_t>(all.data() + 10, session);  // also 0
  return all;
}

TEST(Replay, FindsNothingInGoodTraffic) {
  Capture capture;
  capture.add(sd(offer()), server_sd, group)
      .add(sd(subscribe()), client_sd, server_sd)
      .add(sd(ack()), server_sd, client_sd)
      .add(request().encode(), client, server)
      .add(response().encode(), server, client)
      .add(segment(1, 1392), client, server)
      .add(segment(1392, 7), client, server)
      .add(sd(offer(), 2), server_sd, group)
      .add(sd(subscribe(), 2), client_sd, server_sd);
  EXPECT_THAT(capture.broken(), IsEmpty());
}

TEST(Replay, TellsWhatNothingWasAbout) {
  const Replay none;
  for (const CaseResult& one : none.results("")) {
    EXPECT_EQ(one.outcome.verdict, Verdict::unsupported);
  }
}

TEST(Replay, FindsWrongHeaders) {
  Call call = request();
  call.service = someip::ServiceId{0};
  EXPECT_THAT(broken_by(call), ElementsAre("ids.service"));
  call = request();
  call.method = someip::MethodId{0x8001};
  EXPECT_THAT(broken_by(call), ElementsAre("ids.method"));
  call = request();
  call.code = someip::ReturnCode::not_ok;
  EXPECT_THAT(broken_by(call), ElementsAre("header.return-code"));
  call = request();
  call.type = someip::MessageType{0x40};
  EXPECT_THAT(broken_by(call), ElementsAre("header.message-type"));
  call = request();
  call.payload.resize(1405);
  EXPECT_THAT(broken_by(call), ElementsAre("udp.size"));
  call = request();
  call.length = 200;
  EXPECT_THAT(broken_by(call), ElementsAre("header.length"));
  EXPECT_THAT(Capture{}.add(request().encode(), client, server_sd).broken(), ElementsAre("sd.port"));
}

TEST(Replay, FindsWrongResponses) {
  const auto answered = [](const Call& answer) {
    return Capture{}.add(request().encode(), client, server).add(answer.encode(), server, client).broken();
  };
  Call call = response();
  call.interface_version = 2;
  EXPECT_THAT(answered(call), ElementsAre("rpc.response-version"));
  call = response();
  call.session = someip::SessionId{2};
  EXPECT_THAT(answered(call), ElementsAre("rpc.response-asked"));
  EXPECT_THAT(Capture{}
                  .add(request().encode(), client, server)
                  .add(response().encode(), server, client)
                  .add(response().encode(), server, client)
                  .broken(),
              ElementsAre("rpc.response-once"));
  // A request in segments may have a response in one piece, and an event may not be answered.
  EXPECT_THAT(Capture{}.add(segment(0, 8), client, server).add(response().encode(), server, client).broken(),
              IsEmpty());
  Call event = request();
  event.method = someip::MethodId{0x8001};
  event.type = someip::MessageType::notification;
  EXPECT_THAT(Capture{}.add(event.encode(), server, client).add(response().encode(), client, server).broken(),
              ElementsAre("rpc.response-asked"));
  // The capture may begin with a response.
  EXPECT_THAT(Capture{}.add(response().encode(), server, client).broken(), IsEmpty());
}

TEST(Replay, FindsWrongSdMessages) {
  SdStimulus wrong = offer();
  wrong.flags |= 0x10U;
  EXPECT_THAT(broken_by(wrong), ElementsAre("sd.reserved"));
  wrong = offer();
  wrong.reserved = 1;
  EXPECT_THAT(broken_by(wrong), ElementsAre("sd.reserved"));
  wrong = offer();
  wrong.flags |= 0x20U;
  EXPECT_THAT(broken_by(wrong), ElementsAre("sd.tc8-flags"));
  wrong = offer();
  wrong.flags = 0;
  EXPECT_THAT(broken_by(wrong), ElementsAre("sd.unicast-flag"));
  wrong = offer();
  wrong.entries_length = 8;
  EXPECT_THAT(broken_by(wrong), ElementsAre("sd.arrays"));
  wrong = offer();
  wrong.entries[0].type = trestle::sd::EntryType{0x3f};
  EXPECT_THAT(broken_by(wrong), ElementsAre("sd.entry-type"));
  wrong = offer();
  wrong.entries[0].second_run.index = 1;
  EXPECT_THAT(broken_by(wrong), ElementsAre("sd.empty-run"));
  wrong = offer();
  wrong.entries[0].first_run.count = 2;
  EXPECT_THAT(broken_by(wrong), ElementsAre("sd.run"));
  wrong = offer();
  wrong.entries[0].first_run.count = 0;
  EXPECT_THAT(broken_by(wrong), ElementsAre("sd.offer-endpoint"));
  wrong = offer();
  wrong.options.push_back(wrong.options.front());
  EXPECT_THAT(broken_by(wrong), ElementsAre("sd.option-repeated"));
  wrong = offer();
  wrong.options[0][3] = std::byte{1};
  EXPECT_THAT(broken_by(wrong), ElementsAre("sd.option-reserved"));
  wrong = offer();
  wrong.options[0][9] = std::byte{0x99};
  EXPECT_THAT(broken_by(wrong), ElementsAre("sd.option-protocol", "sd.offer-endpoint"));
  wrong = offer();
  wrong.options[0][2] = std::byte{0x77};
  EXPECT_THAT(broken_by(wrong), ElementsAre("sd.option-layout", "sd.offer-endpoint"));
  wrong = offer();
  wrong.entries[0].type = trestle::sd::EntryType::find_service;
  EXPECT_THAT(broken_by(wrong), ElementsAre("sd.option-counts", "sd.find-minor"));
  Bytes header = sd(offer());
  header[13] = std::byte{2};
  EXPECT_THAT(Capture{}.add(header, server_sd, group).broken(), ElementsAre("sd.header"));
  EXPECT_THAT(Capture{}.add(sd(offer(), 0), server_sd, group).broken(), ElementsAre("sd.session"));
}

TEST(Replay, FollowsSessionsAndTheRebootFlagOfEachReceiver) {
  const auto sessions = [](std::initializer_list<std::pair<int, bool>> all) {
    Capture capture;
    for (const auto& [session, reboot] : all) {
      capture.add(sd(offer(), static_cast<std::uint16_t>(session), reboot), server_sd, group);
    }
    return capture.broken();
  };
  EXPECT_THAT(sessions({{1, true}, {2, true}, {5, true}}), IsEmpty());
  EXPECT_THAT(sessions({{5, true}, {1, true}, {2, true}}), IsEmpty());  // a restart
  EXPECT_THAT(sessions({{0xfffe, true}, {0xffff, true}, {1, false}, {2, false}}), IsEmpty());
  EXPECT_THAT(sessions({{7, false}, {1, true}}), IsEmpty());
  EXPECT_THAT(sessions({{7, false}, {6, false}}), ElementsAre("sd.session-order"));
  EXPECT_THAT(sessions({{7, true}, {8, false}}), ElementsAre("sd.reboot-flag"));
  EXPECT_THAT(sessions({{7, true}, {7, true}}), IsEmpty());  // recorded twice
  // Another receiver has numbers of its own.
  EXPECT_THAT(Capture{}
                  .add(sd(offer(), 7, false), server_sd, group)
                  .add(sd(offer(), 3, false), server_sd, client_sd)
                  .broken(),
              IsEmpty());
}

TEST(Replay, FollowsSubscriptions) {
  EXPECT_THAT(Capture{}.add(sd(subscribe()), client_sd, group).broken(), ElementsAre("sd.unicast-only"));
  SdStimulus wrong = subscribe();
  wrong.entries[0].tail |= 0x0100'0000U;
  EXPECT_THAT(Capture{}.add(sd(wrong), client_sd, server_sd).broken(), ElementsAre("sd.entry-reserved"));
  wrong = subscribe();
  wrong.entries[0].first_run.count = 0;
  EXPECT_THAT(Capture{}.add(sd(wrong), client_sd, server_sd).broken(), ElementsAre("sd.subscribe-endpoint"));
  const auto answered = [](const SdStimulus& answer) {
    return Capture{}
        .add(sd(subscribe()), client_sd, server_sd)
        .add(sd(answer), server_sd, client_sd)
        .add(sd(offer()), server_sd, group)
        .add(sd(offer(), 2), server_sd, group)
        .broken();
  };
  EXPECT_THAT(answered(ack()), IsEmpty());
  EXPECT_THAT(answered(offer()), ElementsAre("sd.subscribe-answered"));
  wrong = ack();
  wrong.entries[0].ttl_s = 6;
  EXPECT_THAT(answered(wrong), ElementsAre("sd.ack-ttl"));
  wrong.entries[0].ttl_s = 0;  // a Nack
  EXPECT_THAT(answered(wrong), IsEmpty());
  wrong = ack();
  wrong.entries[0].tail = 3;
  EXPECT_THAT(answered(wrong), ElementsAre("sd.subscribe-answered", "sd.ack-asked"));
  // The capture may begin with the answer.
  EXPECT_THAT(Capture{}.add(sd(ack()), server_sd, client_sd).broken(), IsEmpty());
}

TEST(Replay, FollowsSegments) {
  const auto segments = [](std::initializer_list<Bytes> all) {
    Capture capture;
    capture.add(request().encode(), client, server);
    for (const Bytes& one : all) {
      capture.add(one, client, server);
    }
    return capture.broken();
  };
  EXPECT_THAT(segments({segment(1, 1392), segment(1393, 1392), segment(2784, 8)}), IsEmpty());
  EXPECT_THAT(segments({segment(0, 16, 1, 0)}), ElementsAre("tp.session"));
  EXPECT_THAT(segments({segment(1, 24)}), ElementsAre("tp.length"));
  EXPECT_THAT(segments({segment(1, 1408)}), ElementsAre("udp.size", "tp.length", "tp.largest"));
  EXPECT_THAT(segments({segment(1, 160)}), ElementsAre("tp.largest"));
  EXPECT_THAT(segments({segment(3, 1392)}), ElementsAre("tp.reserved"));
  EXPECT_THAT(segments({segment(1393, 1392)}), ElementsAre("tp.order"));
  EXPECT_THAT(segments({segment(1, 1392), segment(2785, 1392)}), ElementsAre("tp.order"));
  EXPECT_THAT(segments({segment(1, 1392), segment(1377, 1392)}), ElementsAre("tp.overlap"));
  EXPECT_THAT(segments({segment(1, 1392), segment(1393, 1376)}), ElementsAre("tp.equal"));
  EXPECT_THAT(segments({segment(1, 1392), segment(1393, 1392, 2)}), ElementsAre("tp.header"));
}

TEST(Replay, HasARuleForEachRequirementThatACaptureShowsOrAReason) {
  for (const RequirementRow& row : requirements()) {
    const auto rules = choose(replay_rules(), {row.id}, Level::tc8);
    EXPECT_EQ(row.testable == "pcap" && rules.empty(), !row.why_no_rule.empty()) << row.id;
  }
}

TEST(Catalogue, HasACaseOrARuleForEachTestableRequirementOrAReason) {
  for (const RequirementRow& row : requirements()) {
    const bool is_judged = !choose(all_cases(), {row.id}, Level::tc8).empty() ||
                           !choose(replay_rules(), {row.id}, Level::tc8).empty();
    EXPECT_EQ(row.testable == "yes" && !is_judged, !row.why_no_case.empty()) << row.id;
  }
}

TEST(Replay, FindsReservedIds) {
  Call call = request();
  call.method = someip::MethodId{0x7fff};
  EXPECT_THAT(broken_by(call), ElementsAre("ids.reserved"));
  SdStimulus wrong = offer();
  wrong.entries[0].instance = someip::any_instance;
  EXPECT_THAT(broken_by(wrong), ElementsAre("sd.instance-id"));
  wrong = subscribe();
  wrong.entries[0].tail = 0;
  EXPECT_THAT(Capture{}.add(sd(wrong), client_sd, server_sd).broken(), ElementsAre("sd.eventgroup-id"));
  SdStimulus find{.entries = {entry(trestle::sd::EntryType::find_service, 0, trestle::sd::any_minor)},
                  .flags = trestle::sd::unicast_flag};
  find.entries[0].instance = someip::any_instance;
  EXPECT_THAT(broken_by(find), IsEmpty());
  find.entries[0].tail = 7;
  EXPECT_THAT(broken_by(find), ElementsAre("sd.find-minor"));
}

TEST(Replay, FindsTwoCallsWithOneSessionId) {
  const auto calls = [](std::uint16_t first, std::uint16_t second) {
    Call call = request();
    Capture capture;
    for (const std::uint16_t session : {first, second}) {
      call.session = someip::SessionId{session};
      capture.add(call.encode(), client, server);
    }
    return capture.broken();
  };
  EXPECT_THAT(calls(7, 7), ElementsAre("rpc.session-counts"));
  EXPECT_THAT(calls(7, 8), IsEmpty());
  EXPECT_THAT(calls(1, 1), IsEmpty());  // it was restarted
}

TEST(Replay, FindsWrongMagicCookiesAndMissingOnes) {
  const auto cookie = [](std::uint16_t method) {
    return Call{
        .service = someip::ServiceId{0xffff},
        .method = someip::MethodId{method},
        .type = method == 0 ? someip::MessageType::request_no_return : someip::MessageType::notification,
        .client = someip::ClientId{0xdead},
        .session = someip::SessionId{0xbeef}};
  };
  EXPECT_THAT(Capture{}
                  .add_tcp(cookie(0).encode(), client, server)
                  .add_tcp(request().encode(), client, server, 9)
                  .add_tcp(cookie(0x8000).encode(), server, client)
                  .broken(),
              IsEmpty());
  Call wrong = cookie(0);
  wrong.client = someip::ClientId{1};
  EXPECT_THAT(Capture{}.add_tcp(wrong.encode(), client, server).broken(), ElementsAre("tcp.cookie"));
  EXPECT_THAT(Capture{}
                  .add_tcp(cookie(0).encode(), client, server)
                  .add_tcp(request().encode(), client, server, 12)
                  .broken(),
              ElementsAre("tcp.cookie-interval"));
}

TEST(Replay, FindsTwoConnectionsThatTakeTurns) {
  const Endpoint other{client.address, 40002};
  const auto calls = [](std::initializer_list<Endpoint> from) {
    Capture capture;
    Call call = request();
    for (const Endpoint& one : from) {
      call.session = someip::SessionId{static_cast<std::uint16_t>(value(call.session) + 1)};
      capture.add_tcp(call.encode(), one, server);
    }
    return capture.broken();
  };
  EXPECT_THAT(calls({client, client, other, other}), IsEmpty());
  EXPECT_THAT(calls({client, other, client}), ElementsAre("tcp.one-connection"));
}

TEST(Replay, JudgesOptionsByTheirType) {
  const auto with = [](const Bytes& option) {
    SdStimulus one = offer();
    one.options.push_back(option);
    one.entries[0].first_run.count = 2;
    return broken_by(one);
  };
  const auto configuration = [](std::initializer_list<unsigned> body) {
    return raw_option(static_cast<std::uint16_t>(body.size()), 1, bytes(body));
  };
  EXPECT_THAT(with(configuration({0, 3, 'a', '=', 'b', 0})), IsEmpty());
  EXPECT_THAT(with(configuration({1, 3, 'a', '=', 'b', 0})), ElementsAre("sd.configuration"));
  EXPECT_THAT(with(configuration({0, 9, 'a', '=', 'b', 0})), ElementsAre("sd.configuration"));
  EXPECT_THAT(with(configuration({0, 2, '=', 'b', 0})), ElementsAre("sd.configuration"));
  EXPECT_THAT(with(raw_option(5, 2, bytes({0, 0, 1, 0, 1}))), IsEmpty());
  EXPECT_THAT(with(raw_option(4, 2, bytes({0, 0, 1, 0}))), ElementsAre("sd.load-balancing"));
  const Bytes multicast = raw_option(9, 0x14, bytes({0, 224, 0, 0, 9, 0, 0x11, 0x12, 0x34}));
  SdStimulus acknowledged = ack();
  acknowledged.options = {multicast};
  acknowledged.entries[0].first_run.count = 1;
  EXPECT_THAT(broken_by(acknowledged), ElementsAre("sd.unicast-only"));
  acknowledged.options[0][4] = std::byte{192};
  EXPECT_THAT(broken_by(acknowledged), ElementsAre("sd.multicast-address", "sd.unicast-only"));
}

TEST(Replay, JudgesTheSdEndpointOption) {
  const Bytes endpoint = raw_option(9, 0x24, bytes({0, 192, 0, 2, 1, 0, 0x11, 0x77, 0x1a}));
  const auto with = [](std::vector<Bytes> options, std::uint8_t index) {
    SdStimulus one = offer();
    options.insert(options.begin() + index, one.options.front());
    one.options = std::move(options);
    one.entries[0].first_run.index = index;
    return broken_by(one);
  };
  EXPECT_THAT(with({endpoint}, 1), IsEmpty());
  EXPECT_THAT(with({endpoint}, 0), ElementsAre("sd.sd-endpoint"));  // behind another one
  Bytes other = endpoint;
  other[4] = std::byte{193};
  EXPECT_THAT(with({endpoint, other}, 2), ElementsAre("sd.sd-endpoint"));
  SdStimulus one = offer();
  one.options.insert(one.options.begin(), endpoint);
  one.entries[0].first_run.count = 2;
  EXPECT_THAT(broken_by(one), ElementsAre("sd.sd-endpoint"));  // an entry refers to it
  Bytes v6(21);
  v6[17 + 1] = std::byte{0x11};
  EXPECT_THAT(with({raw_option(21, 0x26, v6)}, 1), ElementsAre("sd.sd-endpoint"));
}

TEST(Replay, JudgesServicesThatAreNotSomeIp) {
  const auto other = [](std::uint16_t service, std::vector<Bytes> options) {
    SdStimulus one = offer();
    one.entries[0].service = someip::ServiceId{service};
    one.entries[0].first_run.count = static_cast<std::uint8_t>(options.size());
    one.options = std::move(options);
    return broken_by(one);
  };
  const Bytes item = raw_option(13, 1, bytes({0, 11, 'o', 't', 'h', 'e', 'r', 's', 'e', 'r', 'v', '=', 'x'}));
  Bytes ended = item;
  ended.push_back(std::byte{0});
  ended[1] = std::byte{14};
  ended[4] = std::byte{11};
  const Bytes groupcast = raw_option(9, 0x15, bytes({0, 1, 2, 3, 4, 5, 6, 0x22, 0xf0}));
  EXPECT_THAT(other(0xfffe, {ended, groupcast}), IsEmpty());
  EXPECT_THAT(other(0xfffe, {groupcast}), ElementsAre("sd.mac-groupcast", "sd.otherserv"));
  EXPECT_THAT(other(0xfffe, {ended, raw_option(8, 0x15, bytes({0, 1, 2, 3, 4, 5, 6, 0x22}))}),
              ElementsAre("sd.mac-groupcast"));
  EXPECT_THAT(other(0x1234, {endpoint_option(server, Transport::udp), ended}), ElementsAre("sd.otherserv"));
}

TEST(Replay, FollowsOffersToTheirEnd) {
  SdStimulus stop = offer();
  stop.entries[0].ttl_s = 0;
  const auto ended_by = [](const SdStimulus& end) {
    return Capture{}.add(sd(offer()), server_sd, group).add(sd(end, 2), server_sd, group).broken();
  };
  EXPECT_THAT(ended_by(stop), IsEmpty());
  stop.entries[0].tail = 7;
  EXPECT_THAT(ended_by(stop), ElementsAre("sd.stop-offer"));
  // A second instance at the same endpoint, and after the first has ended.
  SdStimulus second = offer();
  second.entries[0].instance = someip::InstanceId{2};
  EXPECT_THAT(ended_by(second), ElementsAre("sd.instance-endpoints"));
  stop.entries[0].tail = 0;
  EXPECT_THAT(Capture{}
                  .add(sd(offer()), server_sd, group)
                  .add(sd(stop, 2), server_sd, group)
                  .add(sd(second, 3), server_sd, group)
                  .broken(),
              IsEmpty());
  // After a restart, everything may be elsewhere.
  EXPECT_THAT(Capture{}.add(sd(offer(), 9), server_sd, group).add(sd(second, 1), server_sd, group).broken(),
              IsEmpty());
}

TEST(Replay, FollowsSubscriptionsToTheirEnd) {
  SdStimulus stop = subscribe();
  stop.entries[0].ttl_s = 0;
  const auto ended_by = [](const SdStimulus& end) {
    return Capture{}
        .add(sd(subscribe()), client_sd, server_sd)
        .add(sd(ack()), server_sd, client_sd)
        .add(sd(end, 2), client_sd, server_sd)
        .broken();
  };
  EXPECT_THAT(ended_by(stop), IsEmpty());
  stop.options = {endpoint_option({client.address, 1}, Transport::udp)};
  EXPECT_THAT(ended_by(stop), ElementsAre("sd.stop-subscribe"));
  SdStimulus elsewhere = subscribe();
  elsewhere.options = {endpoint_option({IpAddress::v4(192, 0, 2, 9), 1}, Transport::udp)};
  EXPECT_THAT(ended_by(elsewhere), ElementsAre("sd.subscribe-address"));
  // An end and a new begin in one message.
  SdStimulus pair = subscribe();
  pair.entries.insert(pair.entries.begin(), pair.entries[0]);
  pair.entries[0].ttl_s = 0;
  EXPECT_THAT(ended_by(pair), IsEmpty());
  pair.entries.insert(pair.entries.begin() + 1, pair.entries[0]);
  pair.entries[1].tail = 5;
  EXPECT_THAT(ended_by(pair), ElementsAre("sd.stop-then-subscribe"));
}

TEST(Replay, FindsSubscriptionsThatCannotWork) {
  SdStimulus wrong = subscribe();
  wrong.options = {endpoint_option({client.address, 0}, Transport::udp)};
  EXPECT_THAT(Capture{}.add(sd(wrong), client_sd, server_sd).broken(), ElementsAre("sd.endpoint-port"));
  // Over TCP, where the service is offered over UDP alone; nobody knows where no offer is in the capture.
  wrong.options = {endpoint_option(client, Transport::tcp)};
  EXPECT_THAT(Capture{}.add(sd(wrong), client_sd, server_sd).broken(), IsEmpty());
  EXPECT_THAT(Capture{}.add(sd(offer()), server_sd, group).add(sd(wrong), client_sd, server_sd).broken(),
              ElementsAre("sd.subscribe-transport"));
  SdStimulus both = offer();
  both.options.push_back(endpoint_option(server, Transport::tcp));
  both.entries[0].first_run.count = 2;
  EXPECT_THAT(Capture{}.add(sd(both), server_sd, group).add(sd(wrong), client_sd, server_sd).broken(),
              IsEmpty());
  const SdStimulus none{.flags = trestle::sd::unicast_flag};
  EXPECT_THAT(broken_by(none), ElementsAre("sd.entries"));
}

TEST(Replay, FindsTwoSubscribersOfOneHostThatTakeTurns) {
  const auto ports = [](std::initializer_list<std::uint16_t> all) {
    Capture capture;
    std::uint16_t session = 0;
    for (const std::uint16_t port : all) {
      SdStimulus one = subscribe();
      one.options = {endpoint_option({client.address, port}, Transport::udp)};
      ++session;
      capture.add(sd(one, session), client_sd, server_sd).add(sd(ack(), session), server_sd, client_sd);
    }
    return capture.broken();
  };
  EXPECT_THAT(ports({1, 1, 2, 2}), IsEmpty());  // it was restarted
  EXPECT_THAT(ports({1, 2, 1}), ElementsAre("sd.one-subscriber"));
}

Call event() {
  Call call = request();
  call.method = someip::MethodId{0x8001};
  call.type = someip::MessageType::notification;
  return call;
}

TEST(Replay, ComparesMessagesWithTheOffersOfTheirService) {
  const auto after_offer = [](const Call& call, const Endpoint& from, const Endpoint& to) {
    return Capture{}.add(sd(offer()), server_sd, group).add(call.encode(), from, to).broken();
  };
  for (const auto type : {someip::MessageType::request, someip::MessageType::request_no_return}) {
    Call call = request();
    call.type = type;
    EXPECT_THAT(after_offer(call, client, server), IsEmpty());
    call.interface_version = 2;
    EXPECT_THAT(after_offer(call, client, server), ElementsAre("rpc.interface-version"));
    EXPECT_THAT(after_offer(call, client, {server.address, 1}), IsEmpty());  // nothing is offered there
    EXPECT_THAT(broken_by(call), IsEmpty());
  }
  EXPECT_THAT(after_offer(event(), server, client), IsEmpty());
  Call wrong = event();
  wrong.interface_version = 2;
  EXPECT_THAT(after_offer(wrong, server, client), ElementsAre("rpc.interface-version"));
  EXPECT_THAT(after_offer(event(), {server.address, 1}, client), ElementsAre("rpc.event-source"));
  // A client that sends an event to a server; of one that sends it to somebody else, the offer may have come
  // before the capture began.
  EXPECT_THAT(after_offer(event(), client, server), ElementsAre("rpc.event-source"));
  EXPECT_THAT(after_offer(event(), client, {IpAddress::v4(192, 0, 2, 3), 1}), IsEmpty());
}

TEST(Replay, FindsAnIdThatIsAMethodAndAnEvent) {
  Call call = request();
  call.type = someip::MessageType::notification;
  EXPECT_THAT(Capture{}.add(request().encode(), client, server).add(call.encode(), server, client).broken(),
              ElementsAre("ids.event", "ids.one-meaning"));
}

TEST(Replay, FindsSessionIdsOfEventsThatNeitherCountNorAre0) {
  const auto events = [](std::initializer_list<std::uint16_t> sessions) {
    Capture capture;
    for (const std::uint16_t session : sessions) {
      Bytes bytes = event().encode();
      someip::store<std::uint16_t>(bytes.data() + 10, session);
      capture.add(bytes, server, client);
    }
    return capture.broken();
  };
  EXPECT_THAT(events({0, 0, 0, 0}), IsEmpty());
  EXPECT_THAT(events({7, 8, 9, 1}), IsEmpty());
  EXPECT_THAT(events({7, 7, 8, 8}), IsEmpty());  // for two subscriptions
  EXPECT_THAT(events({7, 7, 7}), ElementsAre("rpc.event-session"));
}

TEST(Replay, NamesThePacketsOfOneCapture) {
  Replay replay;
  const auto reason = [&] {
    return replay.results("")[static_cast<std::size_t>(Rule::header_protocol)].outcome.reason;
  };
  const auto add = [&](std::uint64_t frame, std::uint8_t protocol) {
    Call call = request();
    call.protocol = protocol;
    replay.datagram({.frame = frame, .flow = {client, server}, .transport = Transport::udp}, call.encode());
  };
  replay.begin("", [](Transport, const Endpoint&) {});
  add(3, 2);
  EXPECT_EQ(reason(), "Protocol Version is 2, expected 1; 1 of 1 is so, packet 3");
  add(4, 1);
  add(7, 5);
  EXPECT_EQ(reason(), "Protocol Version is 2, expected 1; 2 of 3 are so, packets 3, 7");
  for (std::uint64_t frame = 10; frame < 20; ++frame) {
    add(frame, 2);
  }
  EXPECT_EQ(reason(),
            "Protocol Version is 2, expected 1; 12 of 13 are so, packets 3, 7, 10, 11, 12, 13, 14, 15, ...");
  replay.begin("b", [](Transport, const Endpoint&) {});
  EXPECT_EQ(reason(), "Protocol Version is 2, expected 1; 12 of 13 are so");
}

TEST(Replay, MissesTheAcknowledgementBeforeEventsOfANewSubscription) {
  const auto early = [&](int offers) {
    Capture capture;
    for (int count = 1; count <= offers; ++count) {
      capture.add(sd(offer(), static_cast<std::uint16_t>(count)), server_sd, group);
    }
    return capture.add(sd(subscribe()), client_sd, server_sd)
        .add(event().encode(), server, client)
        .add(sd(ack()), server_sd, client_sd)
        .broken();
  };
  EXPECT_THAT(early(2), ElementsAre("sd.event-after-ack"));
  EXPECT_THAT(early(1), IsEmpty());  // it may have been there before
}

TEST(Replay, JudgesOneHostAlone) {
  Replay replay{server_sd.address};
  replay.begin("", [](Transport, const Endpoint&) {});
  Call call = request();
  call.protocol = 2;
  const auto verdict = [&](const Endpoint& from, const Endpoint& to) {
    replay.datagram({.frame = 1, .flow = {from, to}, .transport = Transport::udp}, call.encode());
    return replay.results("")[static_cast<std::size_t>(Rule::header_protocol)].outcome.verdict;
  };
  EXPECT_EQ(verdict(client, server), Verdict::unsupported);
  EXPECT_EQ(verdict(server, client), Verdict::fail);
}

TEST(Replay, LeavesOutCopiesOfAMirrorPort) {
  const auto broken = [](std::chrono::milliseconds after) {
    return Capture{after}
        .add(request().encode(), client, server)
        .add(response().encode(), server, client)
        .broken();
  };
  EXPECT_THAT(broken(1ms), IsEmpty());
  EXPECT_THAT(broken(50ms), ElementsAre("rpc.response-once"));
  // Two that are the same in one datagram are two.
  Bytes both = response().encode();
  append(both, response().encode());
  EXPECT_THAT(Capture{1ms}.add(request().encode(), client, server).add(both, server, client).broken(),
              ElementsAre("rpc.response-once"));
}

TEST(Replay, TellsACaptureOfAMirrorPort) {
  const auto most_twice = [](std::chrono::milliseconds after) {
    CopyCount count;
    for (std::uint16_t number = 1; number <= 10; ++number) {
      const Bytes message = sd({.entries = {entry(trestle::sd::EntryType::offer_service, 0)}}, number);
      for (std::uint64_t copy = 0; copy < 2; ++copy) {
        count.datagram({.frame = 2U * number + copy,
                        .time = pcaps::Timestamp{number * 1s} + copy * after,
                        .flow = {server_sd, group},
                        .transport = Transport::udp},
                       message);
      }
    }
    return count.most_twice();
  };
  EXPECT_TRUE(most_twice(1ms));
  EXPECT_FALSE(most_twice(50ms));
}

}  // namespace
}  // namespace trestle::conform::replay_test
