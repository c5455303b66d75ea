#include "someip/core/stream_parser.hpp"

#include <gmock/gmock.h>

#include <algorithm>
#include <string>

#include "someip/core/magic_cookie.hpp"
#include "test/bytes.hpp"
#include "test/covers.hpp"

namespace trestle::someip::stream_parser_test {
namespace {
using namespace std::chrono_literals;
using test::covers;
using test::hex;
using test::to_hex;
using testing::ElementsAre;
using testing::IsEmpty;

// Three messages of 16, 21 and 19 bytes, and the two cookies.
const std::string empty_request = "1234 0421 00000008 0001 0001 01 01 00 00";
const std::string response = "1234 0421 0000000d 0001 0001 01 01 80 00 aabbccddee";
const std::string event = "1234 8001 0000000b 0000 0007 01 01 02 00 010203";
const std::string client_cookie = "ffff 0000 00000008 dead beef 01 01 01 00";
const std::string server_cookie = "ffff 8000 00000008 dead beef 01 01 02 00";
const std::string short_length = "1234 0421 00000007 0001 0001 01 01 00 00";
const std::string huge = "1234 0421 00000019 0001 0001 01 01 00 00";  // 17 bytes of payload: one too many

/// What a message is told apart by in these tests: method, type and payload.
std::string text(const Message& message) {
  return std::to_string(value(message.header.method)) + "/" +
         std::to_string(static_cast<int>(message.header.type)) + ":" + to_hex(message.payload);
}
const std::string empty_request_text = "1057/0:";
const std::string response_text = "1057/128:aabbccddee";
const std::string event_text = "32769/2:010203";

class StreamParserTest : public testing::Test {
 protected:
  /// The messages that this chunk made complete. The chunk lies in memory of its very size, so that the
  /// sanitizers see every byte beyond.
  std::vector<std::string> feed(ByteView chunk) {
    const std::vector<std::byte> exact{chunk.begin(), chunk.end()};
    std::vector<std::string> result;
    parser.feed(exact);
    while (const auto message = parser.next()) {
      result.push_back(text(*message));
    }
    return result;
  }
  std::vector<std::string> feed(const std::string& digits) { return feed(hex(digits)); }

  /// The same, with what belongs into the parser's buffer put there directly.
  std::vector<std::string> receive(ByteView chunk) {
    const ByteSpan place = parser.missing();
    std::copy_n(chunk.begin(), std::min(place.size(), chunk.size()), place.begin());
    const std::size_t direct = parser.filled(chunk.size());
    std::vector<std::string> result;
    while (const auto message = parser.next()) {
      result.push_back(text(*message));
    }
    for (const std::string& more : feed(chunk.subspan(direct))) {
      result.push_back(more);
    }
    return result;
  }

  void restart() { parser = StreamParser{buffer}; }

  std::vector<std::byte> buffer = std::vector<std::byte>(32);
  StreamParser parser{buffer};
};

TEST_F(StreamParserTest, FindsSeveralMessagesInOneChunk) {
  covers({"feat_req_someip_585", "feat_req_someip_702", "feat_req_someip_664"});
  EXPECT_THAT(feed(empty_request + response + event),
              ElementsAre(empty_request_text, response_text, event_text));
  EXPECT_EQ(parser.counters(), (StreamCounters{.messages = 3}));
  EXPECT_FALSE(parser.in_message());
}

TEST_F(StreamParserTest, FindsTheSameMessagesWhereverTheStreamIsCut) {
  covers({"feat_req_someip_664", "feat_req_someip_586"});
  const auto stream = hex(response + client_cookie + event + empty_request);
  for (std::size_t first = 0; first <= stream.size(); ++first) {
    for (std::size_t second = first; second <= stream.size(); ++second) {
      restart();
      std::vector<std::string> found = feed(ByteView{stream}.first(first));
      for (const ByteView rest :
           {ByteView{stream}.subspan(first, second - first), ByteView{stream}.subspan(second)}) {
        const auto more = feed(rest);
        found.insert(found.end(), more.begin(), more.end());
      }
      ASSERT_THAT(found, ElementsAre(response_text, event_text, empty_request_text))
          << "cut at " << first << " and " << second;
      ASSERT_EQ(parser.counters(), (StreamCounters{.messages = 3, .cookies = 1}));
      ASSERT_FALSE(parser.in_message());
    }
  }
}

TEST_F(StreamParserTest, FindsMessagesThatComeByteByByte) {
  const auto stream = hex(response + client_cookie + event);
  std::vector<std::string> found;
  for (const std::byte& byte : stream) {
    for (const std::string& one : feed(ByteView{&byte, 1})) {
      found.push_back(one);
    }
  }
  EXPECT_THAT(found, ElementsAre(response_text, event_text));
}

TEST_F(StreamParserTest, HandsOutAWholeMessageWhereItLies) {
  const auto chunk = hex(response + event);
  parser.feed(chunk);
  EXPECT_EQ(parser.next()->payload.data(), chunk.data() + 16);
  EXPECT_EQ(parser.next()->payload.data(), chunk.data() + 21 + 16);
  EXPECT_FALSE(parser.next());
}

TEST_F(StreamParserTest, WaitsForALargerBufferWhereAMessageFillsIt) {
  std::vector<std::byte> first(20);
  StreamParser growing{first, 32};
  const auto bytes = hex("1234 8001 00000013 0000 0007 01 01 02 00 0102030405060708090a0b" + event);
  growing.feed(ByteView{bytes}.first(18));  // what is whole stays where it lies
  EXPECT_FALSE(growing.next());
  growing.feed(ByteView{bytes}.subspan(18));
  EXPECT_FALSE(growing.next());
  EXPECT_EQ(growing.held(), 20U);
  EXPECT_EQ(growing.needed(), 27U);
  EXPECT_EQ(growing.waiting(), bytes.size() - 20);
  EXPECT_THAT(growing.missing(), IsEmpty());
  std::vector<std::byte> second(first);
  second.resize(27);
  growing.use(second);
  const auto message = growing.next();
  ASSERT_TRUE(message);
  EXPECT_EQ(to_hex(message->payload), "0102030405060708090a0b");
  EXPECT_TRUE(growing.next());
  EXPECT_FALSE(growing.next());
  EXPECT_EQ(growing.waiting(), 0U);
  const auto larger = hex("1234 8001 00000019 0000 0007 01 01 02 00");
  growing.feed(larger);
  EXPECT_FALSE(growing.next());
  EXPECT_EQ(growing.counters().too_large, 1U) << "33 bytes";
}

TEST_F(StreamParserTest, TakesTheRestOfAMessageStraightIntoItsBuffer) {
  EXPECT_THAT(parser.missing(), IsEmpty());
  const auto stream = hex(response + event);
  EXPECT_THAT(feed(ByteView{stream}.first(15)), IsEmpty());
  EXPECT_THAT(parser.missing(), IsEmpty()) << "the header, and with it the size, is not complete";
  EXPECT_THAT(feed(ByteView{stream}.subspan(15, 3)), IsEmpty());
  EXPECT_TRUE(parser.in_message());
  ASSERT_EQ(parser.missing().size(), 3U);
  EXPECT_EQ(parser.missing().data(), buffer.data() + 18);
  EXPECT_THAT(receive(ByteView{stream}.subspan(18)), ElementsAre(response_text, event_text));
  EXPECT_THAT(parser.missing(), IsEmpty());
}

TEST_F(StreamParserTest, FindsTheSameMessagesWhenReceivingStraightIntoItsBuffer) {
  const auto stream = hex(response + client_cookie + event + empty_request);
  for (std::size_t step = 1; step <= stream.size(); ++step) {
    restart();
    std::vector<std::string> found;
    for (std::size_t at = 0; at < stream.size(); at += step) {
      const auto more = receive(ByteView{stream}.subspan(at, std::min(step, stream.size() - at)));
      found.insert(found.end(), more.begin(), more.end());
    }
    ASSERT_THAT(found, ElementsAre(response_text, event_text, empty_request_text)) << "steps of " << step;
  }
}

TEST_F(StreamParserTest, LeavesOutCookiesOfBothDirectionsAnywhere) {
  covers({"feat_req_someip_609", "feat_req_someip_589"});
  EXPECT_THAT(feed(client_cookie + server_cookie + event + client_cookie + empty_request + server_cookie),
              ElementsAre(event_text, empty_request_text));
  EXPECT_EQ(parser.counters(), (StreamCounters{.messages = 2, .cookies = 4}));
}

TEST_F(StreamParserTest, TakesOnlyExactCookiesForCookies) {
  // Another client id, and a message with a payload.
  EXPECT_THAT(feed("ffff 0000 00000008 dead beee 01 01 01 00 ffff 0000 00000009 dead beef 01 01 01 00 55"),
              ElementsAre("0/1:", "0/1:55"));
  EXPECT_EQ(parser.counters().cookies, 0U);
}

TEST_F(StreamParserTest, DoesNotSearchPayloadsForCookies) {
  EXPECT_THAT(feed("1234 8001 00000018 0000 0007 01 01 02 00" + client_cookie + event),
              ElementsAre("32769/2:ffff000000000008deadbeef01010100", event_text));
  EXPECT_EQ(parser.counters().cookies, 0U);
}

TEST_F(StreamParserTest, LosesFramingOverALengthThatCannotBe) {
  covers({"feat_req_someip_798"});
  for (const char* const length : {"00000000", "00000001", "00000007"}) {
    restart();
    std::string digits = "1234 0421 0001 0001 01 01 00 00";
    EXPECT_THAT(feed(digits.insert(10, length).append(event)), IsEmpty());
    EXPECT_TRUE(parser.lost());
    EXPECT_EQ(parser.counters().bad_length, 1U);
    EXPECT_THAT(feed(event + event), IsEmpty()) << "nobody knows where messages begin";
  }
}

TEST_F(StreamParserTest, LosesFramingOverAMessageThatTheBufferCannotTake) {
  EXPECT_THAT(feed("1234 0421 00000018 0001 0001 01 01 00 00 000102030405060708090a0b0c0d0e0f"),
              ElementsAre("1057/0:000102030405060708090a0b0c0d0e0f"))
      << "as large as the buffer";
  EXPECT_THAT(feed(huge), IsEmpty());
  EXPECT_TRUE(parser.lost());
  EXPECT_THAT(parser.missing(), IsEmpty());
  EXPECT_EQ(parser.counters().too_large, 1U);
  restart();
  EXPECT_THAT(feed("1234 0421 ffffffff 0001 0001 01 01 00 00" + event), IsEmpty());
  EXPECT_EQ(parser.counters(), (StreamCounters{.too_large = 1, .skipped_bytes = 16 + 19 - 15}));
}

TEST_F(StreamParserTest, GoesOnBehindTheNextCookie) {
  covers({"feat_req_someip_586"});
  for (const std::string& damage : {short_length, huge}) {
    for (const std::string& cookie : {client_cookie, server_cookie}) {
      // Garbage that nearly is a cookie, so that the search may not jump too far.
      const std::string garbage = damage + "ff ffff ffff 0000 00000008 dead ffff 0000 ff";
      std::string text = garbage;
      text.append(cookie).append(response).append(event);
      const auto stream = hex(text);
      for (std::size_t first = 0; first <= stream.size(); ++first) {
        for (std::size_t second = first; second <= std::min(first + 40, stream.size()); ++second) {
          restart();
          std::vector<std::string> found;
          for (const ByteView part :
               {ByteView{stream}.first(first), ByteView{stream}.subspan(first, second - first),
                ByteView{stream}.subspan(second)}) {
            const auto more = feed(part);
            found.insert(found.end(), more.begin(), more.end());
          }
          ASSERT_THAT(found, ElementsAre(response_text, event_text)) << "cut at " << first << ", " << second;
          ASSERT_FALSE(parser.lost());
          ASSERT_EQ(parser.counters().skipped_bytes, hex(garbage).size());
          ASSERT_EQ(parser.counters().cookies, 1U);
          ASSERT_EQ(parser.counters().resynchronised, 1U);
        }
      }
    }
  }
}

TEST_F(StreamParserTest, FindsACookieInTheMidstOfAMessageThatDamageMadeEndEarly) {
  EXPECT_THAT(feed(short_length + "00 11 22" + server_cookie + event), ElementsAre(event_text));
  EXPECT_THAT(feed(huge + "00" + client_cookie + response), ElementsAre(response_text));
  EXPECT_EQ(parser.counters(), (StreamCounters{.messages = 2,
                                               .cookies = 2,
                                               .bad_length = 1,
                                               .too_large = 1,
                                               .skipped_bytes = 19 + 17,
                                               .resynchronised = 2}));
}

TEST_F(StreamParserTest, TellsOfAStreamThatWasCutOffInAMessage) {
  EXPECT_FALSE(parser.in_message());
  feed("12");
  EXPECT_TRUE(parser.in_message());
  feed(empty_request.substr(2));
  EXPECT_FALSE(parser.in_message());
}

TEST(MagicCookie, IsTheHeaderThatTheSpecificationShows) {
  covers({"feat_req_someip_609", "feat_req_someip_589", "feat_req_someipids_530"});
  EXPECT_EQ(to_hex(magic_cookie(StreamEnd::client)), "ffff000000000008deadbeef01010100");
  EXPECT_EQ(to_hex(magic_cookie(StreamEnd::server)), "ffff800000000008deadbeef01010200");
  for (const StreamEnd end : {StreamEnd::client, StreamEnd::server}) {
    EXPECT_EQ(decode(magic_cookie(end))->header, magic_cookie_header(end));
  }
}

TEST(CookieSchedule, AddsACookieEveryTenSecondsWhileMessagesAreSent) {
  covers({"feat_req_someip_593", "feat_req_someip_594"});
  constexpr TimePoint start{1000s};
  CookieSchedule schedule;
  EXPECT_TRUE(schedule.before_message(start));
  EXPECT_FALSE(schedule.before_message(start));
  EXPECT_FALSE(schedule.before_message(start + 9999ms));
  EXPECT_TRUE(schedule.before_message(start + 10s));
  EXPECT_FALSE(schedule.before_message(start + 19999ms));
  EXPECT_TRUE(schedule.before_message(start + 1000s)) << "nothing was sent for long, so nothing in between";
  EXPECT_FALSE(schedule.before_message(start + 1001s));
}

TEST(StreamCounters, AddUp) {
  StreamCounters sum{
      .messages = 1, .cookies = 2, .bad_length = 3, .too_large = 4, .skipped_bytes = 5, .resynchronised = 6};
  sum += {.messages = 10,
          .cookies = 20,
          .bad_length = 30,
          .too_large = 40,
          .skipped_bytes = 50,
          .resynchronised = 60};
  EXPECT_EQ(sum, (StreamCounters{.messages = 11,
                                 .cookies = 22,
                                 .bad_length = 33,
                                 .too_large = 44,
                                 .skipped_bytes = 55,
                                 .resynchronised = 66}));
}

}  // namespace
}  // namespace trestle::someip::stream_parser_test
