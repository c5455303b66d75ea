// The requests, answers, events and segments of every recorded conversation: given what the recorded side was
// asked and what its application said, our core has to make the same bytes of it.
#include <fmt/format.h>
#include <gmock/gmock.h>

#include <algorithm>
#include <array>
#include <cstdlib>
#include <filesystem>
#include <map>
#include <tuple>

#include "someip/core/call_table.hpp"
#include "someip/core/magic_cookie.hpp"
#include "someip/core/request_check.hpp"
#include "someip/core/session_counter.hpp"
#include "someip/core/tp_reassembler.hpp"
#include "someip/core/tp_segmenter.hpp"
#include "test/bytes.hpp"
#include "test/covers.hpp"
#include "test/replay/recording.hpp"
#include "test/someip/tp_slots.hpp"
#include "test/source_dir.hpp"

namespace trestle::test::messages_test {
namespace {
using namespace std::chrono_literals;
using namespace someip;

constexpr IpAddress server_address = IpAddress::v4(10, 0, 0, 1);
constexpr IpAddress client_address = IpAddress::v4(10, 0, 0, 2);
constexpr std::uint16_t sd_port = 30490;

std::string path_of(const std::string& file) {
  return test::source_dir() + "/pcaps/vsomeip/" + file + ".pcap";
}

/// A message of the recording, segments put together, and its bytes as they were sent.
struct Heard {
  Duration time{};
  Endpoint from;
  Endpoint to;
  Transport transport = Transport::udp;
  Header header;
  std::vector<std::byte> payload;
  std::vector<std::vector<std::byte>> sent;  ///< one message, or its segments in their order
};

std::vector<std::byte> bytes_of(ByteView view) {
  return {view.begin(), view.end()};
}

/// All messages but those of service discovery. Our reassembler makes one of segments.
class Conversation {
 public:
  explicit Conversation(const std::string& path) : recording_{read_recording(path)} {
    for (const RecordedBytes& datagram : recording_.datagrams) {
      if (datagram.from.port != sd_port && datagram.to.port != sd_port) {
        MessageCursor cursor{datagram.bytes};
        while (const auto message = cursor.next()) {
          add(datagram, *message, Transport::udp);
        }
      }
    }
    for (const RecordedBytes& recorded : recording_.stream_messages) {
      if (const auto message = decode(recorded.bytes)) {
        add(recorded, *message, Transport::tcp);
      }
    }
    std::stable_sort(heard.begin(), heard.end(),
                     [](const Heard& a, const Heard& b) { return a.time < b.time; });
  }

  std::vector<Heard> heard;
  std::size_t lost_segments = 0;

 private:
  using Key = std::tuple<Endpoint, ServiceId, MethodId, ClientId, SessionId>;

  void add(const RecordedBytes& recorded, const Message& message, Transport transport) {
    std::vector<std::byte> bytes(message.size());
    ASSERT_TRUE(encode(message.header, message.payload, bytes));
    if (!is_tp(message.header.type)) {
      heard.push_back({recorded.time,
                       recorded.from,
                       recorded.to,
                       transport,
                       message.header,
                       bytes_of(message.payload),
                       {std::move(bytes)}});
      return;
    }
    const Header& header = message.header;
    auto& segments = segments_[{recorded.from, header.service, header.method, header.client, header.session}];
    segments.push_back(std::move(bytes));
    const auto whole = reassembler_.on_segment(recorded.from, message, TimePoint{1000s} + recorded.time);
    if (!whole) {
      ++lost_segments;
    } else if (*whole) {
      heard.push_back({recorded.time, recorded.from, recorded.to, transport, (*whole)->header,
                       bytes_of((*whole)->payload), std::exchange(segments, {})});
    }
  }

  Recording recording_;
  TpSlots slots_{8, std::size_t{1} << 21U};
  TpReassembler reassembler_{
      slots_.slots(), {.max_message_bytes = std::size_t{1} << 21U, .max_per_sender = 8, .max_age = 20s}};
  std::map<Key, std::vector<std::vector<std::byte>>> segments_;
};

std::string in_hex(const std::vector<std::vector<std::byte>>& sent) {
  std::string digits;
  for (const auto& bytes : sent) {
    digits += to_hex(ByteView{bytes}.first(std::min<std::size_t>(bytes.size(), 200))) + "\n";
  }
  return digits;
}

/// The bytes that we send for a message: itself, or its segments of the size that the recorded side chose.
std::vector<std::vector<std::byte>> encoded(const Header& header, const Heard& like) {
  std::vector<std::vector<std::byte>> result;
  if (like.sent.size() == 1 && !is_tp(MessageType{std::to_integer<std::uint8_t>(like.sent.front()[14])})) {
    std::vector<std::byte> room(header_bytes + like.payload.size());
    const auto bytes = encode(header, like.payload, room);
    return {bytes ? bytes_of(*bytes) : std::vector<std::byte>{}};
  }
  const std::size_t segment_bytes = like.sent.front().size() - header_bytes - tp_header_bytes;
  TpSegmenter segmenter{header, like.payload.size(), segment_bytes};
  while (const auto segment = segmenter.next()) {
    std::vector<std::byte> bytes = bytes_of(segment->header);
    const auto slice = ByteView{like.payload}.subspan(segment->offset, segment->bytes);
    bytes.insert(bytes.end(), slice.begin(), slice.end());
    result.push_back(std::move(bytes));
  }
  return result;
}

bool is_answer(const Header& header) {
  return header.type == MessageType::response || header.type == MessageType::error;
}

/// What a capture holds; each number is counted by the test that needs it.
struct Contents {
  const char* file;
  std::size_t requests;  ///< that await an answer
  std::size_t answers;
  std::size_t events;
  std::size_t fire_and_forget;
  std::size_t segmented;  ///< messages among these that came in segments
};
void PrintTo(const Contents& contents, std::ostream* out) {
  *out << contents.file;
}

class RecordedMessages : public testing::TestWithParam<Contents> {};

TEST_P(RecordedMessages, AreTheClientsOnesOfOurCalls) {
  covers({"feat_req_someip_79", "feat_req_someip_88", "feat_req_someip_329", "feat_req_someip_338",
          "feat_req_someiptp_765", "feat_req_someiptp_774", "feat_req_someiptp_777"});
  const Conversation conversation{path_of(GetParam().file)};
  std::array<CallSlot, 64> slots{};
  // vsomeip counts the sessions of calls and of fire and forget together, so does a client of ours.
  std::optional<CallTable> calls;
  SessionId next{};
  std::size_t requests = 0;
  std::size_t answers = 0;
  std::size_t fire_and_forget = 0;
  for (const Heard& heard : conversation.heard) {
    const TimePoint now{1000s + heard.time};
    if (heard.from.address == client_address && heard.header.type == MessageType::request_no_return) {
      Header header = heard.header;
      header.session = next == SessionId{} ? heard.header.session : next;
      EXPECT_TRUE(encoded(header, heard) == heard.sent) << in_hex(heard.sent);
      next = SessionId{static_cast<std::uint16_t>(value(heard.header.session) + 1U)};
      calls.reset();
      ++fire_and_forget;
    } else if (heard.from.address == client_address && heard.header.type == MessageType::request) {
      ++requests;
      if (!calls || heard.header.session == SessionId{1}) {  // or the client was started anew
        slots = {};
        calls.emplace(slots, heard.header.client, heard.header.session);
        if (next != SessionId{} && heard.header.session != SessionId{1}) {
          EXPECT_EQ(heard.header.session, next);
        }
      }
      const auto call = calls->start({heard.to, heard.transport}, heard.header.service, heard.header.method,
                                     heard.header.interface_version, 5s, now);
      ASSERT_TRUE(call);
      EXPECT_TRUE(encoded(call->header, heard) == heard.sent) << in_hex(heard.sent);
      next = SessionId{static_cast<std::uint16_t>(value(call->header.session) + 1U)};
    } else if (heard.to.address == client_address && is_answer(heard.header)) {
      ++answers;
      ASSERT_TRUE(calls);
      const auto answer = calls->on_answer({heard.from, heard.transport}, heard.header);
      ASSERT_TRUE(answer) << to_string(answer.error());
      EXPECT_EQ(answer->code, heard.header.return_code);
    }
  }
  EXPECT_EQ(requests, GetParam().requests);
  EXPECT_EQ(answers, GetParam().answers);
  EXPECT_EQ(fire_and_forget, GetParam().fire_and_forget);
  EXPECT_EQ(conversation.lost_segments, 0U);
}

TEST_P(RecordedMessages, AreTheServersOnesOfOurAnswersAndEvents) {
  covers({"feat_req_someip_338", "feat_req_someip_655", "feat_req_someip_721", "feat_req_someip_88",
          "feat_req_someiptp_765", "feat_req_someiptp_774", "feat_req_someiptp_777"});
  const Conversation conversation{path_of(GetParam().file)};
  std::vector<const Heard*> open;
  SessionCounter counter;
  SessionId session{};
  const Heard* last_event = nullptr;
  std::size_t answers = 0;
  std::size_t events = 0;
  std::size_t segmented = 0;
  for (const Heard& heard : conversation.heard) {
    segmented += heard.sent.size() > 1 ? 1 : 0;
    if (heard.to.address == server_address && heard.header.type == MessageType::request) {
      open.push_back(&heard);
    } else if (heard.from.address == server_address && is_answer(heard.header)) {
      ++answers;
      const auto request = std::find_if(open.begin(), open.end(), [&](const Heard* asked) {
        return asked->from == heard.to && asked->header.client == heard.header.client &&
               asked->header.session == heard.header.session && asked->header.method == heard.header.method;
      });
      ASSERT_NE(request, open.end()) << "session " << value(heard.header.session);
      const RequestCheck check =
          check_request((*request)->header,
                        {.service = true, .interface_version = true, .method = MethodKind::request_response});
      EXPECT_FALSE(check.fault);
      EXPECT_TRUE(encoded(answer_header((*request)->header, ReturnCode::ok), heard) == heard.sent)
          << in_hex(heard.sent);
      open.erase(request);
    } else if (heard.from.address == server_address && heard.header.type == MessageType::notification) {
      ++events;
      // vsomeip counts the events of a process together, our Node each event by itself. Either does: what
      // counts is that they tell messages of one kind apart.
      const bool to_another = last_event != nullptr && last_event->to != heard.to &&
                              last_event->payload == heard.payload &&
                              last_event->header.method == heard.header.method;
      if (!to_another) {
        const bool anew = last_event != nullptr && heard.header.session == SessionId{1};
        counter = anew ? SessionCounter{} : counter;  // the server was started anew
        session = counter.next();
      }
      last_event = &heard;
      const Header header{.service = heard.header.service,
                          .method = heard.header.method,
                          .session = session,
                          .interface_version = heard.header.interface_version,
                          .type = MessageType::notification};
      EXPECT_TRUE(encoded(header, heard) == heard.sent) << in_hex(encoded(header, heard)) << "was\n"
                                                        << in_hex(heard.sent);
    }
  }
  EXPECT_THAT(open, testing::IsEmpty());
  EXPECT_EQ(answers, GetParam().answers);
  EXPECT_EQ(events, GetParam().events);
  EXPECT_EQ(segmented, GetParam().segmented);
}

INSTANTIATE_TEST_SUITE_P(Vsomeip, RecordedMessages,
                         testing::Values(Contents{"e2e_events_p01_p04_p05_p07_crc32", 0, 0, 22, 0, 2},
                                         Contents{"field_getter_setter_notifier", 4, 4, 6, 0, 0},
                                         Contents{"fire_and_forget_udp_tcp", 0, 0, 0, 10, 0},
                                         Contents{"npdu_several_messages_per_datagram", 5, 5, 45, 16, 0},
                                         Contents{"reboot_client_kill9", 6, 6, 63, 0, 0},
                                         Contents{"reboot_service_kill9", 3, 3, 49, 0, 0},
                                         Contents{"rr_tcp", 16, 16, 0, 0, 0},
                                         Contents{"rr_tcp_magic_cookies", 6, 6, 0, 0, 0},
                                         Contents{"rr_udp", 19, 19, 0, 0, 0},
                                         Contents{"sd_default_timing", 2, 2, 2, 0, 0},
                                         Contents{"sd_multicast_eventgroup", 0, 0, 10, 0, 0},
                                         Contents{"sd_offer_find_subscribe_ack_udp", 0, 0, 5, 0, 0},
                                         Contents{"sd_service_first_client_late", 2, 2, 2, 0, 0},
                                         Contents{"sd_stopoffer_stopsubscribe_reoffer", 0, 0, 4, 0, 0},
                                         Contents{"sd_subscribe_tcp_events", 0, 0, 7, 0, 0},
                                         Contents{"sd_subscribe_udp_and_tcp_same_eventgroup", 0, 0, 6, 0, 0},
                                         Contents{"tp_event_1mib_plus", 0, 0, 2, 0, 2},
                                         Contents{"tp_event_multicast", 0, 0, 4, 0, 4},
                                         Contents{"tp_event_small_to_256k", 0, 0, 12, 0, 10},
                                         Contents{"tp_request_response", 13, 13, 0, 0, 18},
                                         Contents{"tp_separation_time_and_short_segments", 2, 2, 10, 0, 12}),
                         [](const auto& contents) { return std::string{contents.param.file}; });

// Every byte of both directions: where vsomeip sends a Magic Cookie, we would, and the same one.
TEST(RecordedCookies, AreThoseThatWeWouldSend) {
  covers({"feat_req_someip_586", "feat_req_someip_589", "feat_req_someip_593", "feat_req_someip_594",
          "feat_req_someip_609"});
  const Recording recording = read_recording(path_of("rr_tcp_magic_cookies"));
  EXPECT_EQ(recording.streams.size(), 2U);
  for (const auto& [ends, bytes] : recording.streams) {
    const StreamEnd sender = ends.first.address == client_address ? StreamEnd::client : StreamEnd::server;
    CookieSchedule schedule;
    std::vector<std::byte> ours;
    std::size_t cookies = 0;
    for (const RecordedBytes& message : recording.stream_messages) {
      if (message.from != ends.first || message.to != ends.second) {
        continue;
      }
      if (schedule.before_message(TimePoint{1000s} + message.time)) {
        const auto cookie = magic_cookie(sender);
        ours.insert(ours.end(), cookie.begin(), cookie.end());
        ++cookies;
      }
      ours.insert(ours.end(), message.bytes.begin(), message.bytes.end());
    }
    EXPECT_EQ(cookies, 1U);
    EXPECT_EQ(to_hex(ours), to_hex(bytes));
  }
}

// Recordings by others that are not kept here.
TEST(PublicRecordedMessages, AreAnsweredInTheSameWay) {
  const char* const shared = std::getenv("TRESTLE_SHARED_PCAPS");
  const std::string folder = shared != nullptr ? shared : test::source_dir() + "/../shared/pcaps/public";
  for (const auto& [file, calls] : {std::pair{"someip-llm-fuzzer/playground_seed.pcapng", 100},
                                    std::pair{"someip-llm-fuzzer/all_defined_methods_once.pcapng", 14},
                                    std::pair{"nDPI/someip-udp-method-call.pcapng", 1}}) {
    const std::string path = folder + "/" + file;
    if (!std::filesystem::exists(path)) {
      GTEST_SKIP() << path << " is not there";
    }
    const Conversation conversation{path};
    int answered = 0;
    for (const Heard& answer : conversation.heard) {
      const auto request =
          std::find_if(conversation.heard.begin(), conversation.heard.end(), [&](const Heard& heard) {
            return heard.from == answer.to && heard.header.type == MessageType::request &&
                   heard.header.client == answer.header.client &&
                   heard.header.session == answer.header.session &&
                   heard.header.method == answer.header.method;
          });
      if (is_answer(answer.header) && request != conversation.heard.end()) {
        EXPECT_TRUE(encoded(answer_header(request->header, ReturnCode::ok), answer) == answer.sent)
            << in_hex(answer.sent);
        ++answered;
      }
    }
    EXPECT_EQ(answered, calls) << file;
  }
}

// A raw client asks what it should not: every answer, and every silence, is what our rules say, where errors
// are configured to come as message type ERROR, as vsomeip's do.
TEST(RecordedErrors, AreAnsweredInTheSameWay) {
  covers({"feat_req_someip_597", "feat_req_someip_654", "feat_req_someip_655", "feat_req_someip_718",
          "feat_req_someip_721", "feat_req_someip_726", "feat_req_someip_816"});
  const Conversation conversation{path_of("errors_raw_client_vs_vsomeip_service")};
  constexpr AnswerRules rules{.error_type = MessageType::error};
  std::size_t answered = 0;
  std::size_t silent = 0;
  for (const Heard& request : conversation.heard) {
    if (request.to.address != server_address) {
      continue;
    }
    const auto answer =
        std::find_if(conversation.heard.begin(), conversation.heard.end(), [&](const Heard& heard) {
          return heard.time >= request.time && heard.to == request.from &&
                 heard.header.method == request.header.method &&
                 heard.header.session == request.header.session &&
                 heard.header.client == request.header.client;
        });
    const std::uint16_t method = value(request.header.method);
    const bool known = method == 0x0421 || (method >= 0x0500 && method <= 0x0502);
    const RequestCheck check =
        check_request(request.header,
                      {.service = request.header.service == ServiceId{0x1234},
                       .interface_version = request.header.interface_version == 1,
                       .method = known ? MethodKind::request_response : MethodKind::unknown},
                      rules);
    const std::string what = in_hex(request.sent);
    if (answer == conversation.heard.end()) {
      ++silent;
      EXPECT_FALSE(check.answer) << what;
      EXPECT_TRUE(check.fault) << what;
    } else if (check.fault) {
      ++answered;
      ASSERT_TRUE(check.answer) << what;
      EXPECT_EQ(*check.answer, answer->header) << what;
      EXPECT_THAT(answer->payload, testing::IsEmpty()) << what;
    } else {
      ++answered;
      // Method 0x0501 answers with an error in a RESPONSE, as the specification has it by itself.
      const AnswerRules of_method = method == 0x0501 ? AnswerRules{} : rules;
      EXPECT_EQ(answer_header(request.header, answer->header.return_code, of_method), answer->header) << what;
    }
  }
  EXPECT_EQ(answered, 23U);
  EXPECT_EQ(silent, 4U);
}

}  // namespace
}  // namespace trestle::test::messages_test
