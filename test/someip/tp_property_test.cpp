// The reassembler against a model that keeps one entry per byte, on random segments, and against what was
// sent.
#include <gmock/gmock.h>

#include <random>

#include "someip/core/tp_segmenter.hpp"
#include "test/bytes.hpp"
#include "test/covers.hpp"
#include "test/someip/tp_model.hpp"
#include "test/someip/tp_slots.hpp"

namespace trestle::someip::tp_property_test {
namespace {
using namespace std::chrono_literals;
using test::covers;
using test::to_hex;
using test::TpModel;
using test::TpSlots;

constexpr TimePoint start{1000s};

class Random {
 public:
  explicit Random(std::uint32_t seed) : engine_{seed} {}
  /// From 0 to `end`, which is left out.
  std::size_t below(std::size_t end) { return engine_() % end; }
  bool one_in(std::size_t n) { return below(n) == 0; }
  template <typename Range>
  void shuffle(Range& range) {
    std::shuffle(range.begin(), range.end(), engine_);
  }

 private:
  std::mt19937 engine_;
};

struct Datagram {
  Endpoint from;
  std::vector<std::byte> bytes;
};

Endpoint host(std::size_t number, std::uint16_t port = 30501) {
  return {IpAddress::v4(10, 0, 0, static_cast<std::uint8_t>(number)), port};
}

std::vector<std::byte> random_bytes(Random& random, std::size_t size) {
  std::vector<std::byte> result(size);
  for (std::byte& byte : result) {
    byte = static_cast<std::byte>(random.below(256));
  }
  return result;
}

/// The datagrams of one message.
std::vector<Datagram> segments(const Endpoint& from, const Header& header, ByteView payload,
                               std::size_t segment_bytes) {
  std::vector<Datagram> result;
  for (TpSegmenter segmenter{header, payload.size(), segment_bytes}; const auto segment = segmenter.next();) {
    Datagram datagram{from, {segment->header.begin(), segment->header.end()}};
    const ByteView slice = payload.subspan(segment->offset, segment->bytes);
    datagram.bytes.insert(datagram.bytes.end(), slice.begin(), slice.end());
    result.push_back(std::move(datagram));
  }
  return result;
}

/// Gives a datagram to the reassembler and the model, and holds one against the other.
class Pair {
 public:
  Pair(std::size_t max_messages, const TpReassemblyLimits& limits)
      : slots_{max_messages, limits.max_message_bytes},
        reassembler_{slots_.slots(), limits},
        model_{max_messages, limits} {}

  /// The completed payload; "" if there is none.
  std::optional<std::vector<std::byte>> offer(const Datagram& datagram, TimePoint now) {
    const auto message = decode(datagram.bytes);
    if (!message) {
      return std::nullopt;
    }
    const auto ours = reassembler_.on_segment(datagram.from, *message, now);
    std::optional<TpDrop> drop;
    const auto theirs = model_.on_segment(datagram.from, *message, now, drop);
    EXPECT_EQ(ours.has_value(), !drop.has_value()) << to_string(drop.value_or(TpDrop{}));
    if (!ours && drop) {
      EXPECT_STREQ(to_string(ours.error()), to_string(*drop));
    }
    EXPECT_EQ(ours && *ours, theirs.has_value());
    EXPECT_EQ(reassembler_.counters().drops, model_.drops);
    EXPECT_EQ(reassembler_.size(), model_.size());
    if (!ours || !*ours || !theirs) {
      return std::nullopt;
    }
    EXPECT_EQ((*ours)->header, theirs->header);
    EXPECT_EQ((*ours)->from, theirs->from);
    EXPECT_EQ(to_hex((*ours)->payload), to_hex(theirs->payload));
    return std::vector<std::byte>{(*ours)->payload.begin(), (*ours)->payload.end()};
  }
  [[nodiscard]] const TpReassembler& reassembler() const { return reassembler_; }

 private:
  TpSlots slots_;
  TpReassembler reassembler_;
  TpModel model_;
};

/// Runs a property with many seeds, until one fails; that one's number is in the report.
template <typename Property>
void for_each_seed(Property property) {
  for (std::uint32_t seed = 1; seed <= 300 && !testing::Test::HasFailure(); ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    property(Random{seed});
  }
}

void restores_every_message(Random random) {
  const std::size_t senders = 1 + random.below(4);
  std::vector<std::vector<std::byte>> sent;
  std::vector<Datagram> wire;
  for (std::size_t sender = 0; sender < senders; ++sender) {
    sent.push_back(random_bytes(random, random.below(700)));
    const Header header{.service = ServiceId{0x1234}, .method = MethodId{0x8001}, .session = SessionId{9}};
    for (Datagram& datagram : segments(host(sender), header, sent.back(), 16 * (1 + random.below(4)))) {
      if (random.one_in(5)) {
        wire.push_back(datagram);
      }
      wire.push_back(std::move(datagram));
    }
  }
  random.shuffle(wire);

  Pair pair{senders, {.max_message_bytes = 700, .max_per_sender = 1, .max_age = 1s}};
  std::vector<std::size_t> arrivals(senders, 0);
  for (const Datagram& datagram : wire) {
    if (const auto payload = pair.offer(datagram, start)) {
      const std::size_t sender = datagram.from.address.bytes[3];
      EXPECT_EQ(to_hex(*payload), to_hex(sent[sender]));
      ++arrivals[sender];
    }
  }
  EXPECT_THAT(arrivals, testing::Each(1U));
}
TEST(TpProperty, RestoresEveryMessageWhateverOrderDuplicatesAndInterleaving) {
  covers({"feat_req_someiptp_783", "feat_req_someiptp_787", "feat_req_someiptp_797", "feat_req_someiptp_803",
          "feat_req_someiptp_820"});
  for_each_seed(restores_every_message);
}

void does_what_the_model_does(Random random) {
  const std::size_t max_messages = 1 + random.below(4);
  Pair pair{max_messages,
            {.max_message_bytes = 100,
             .max_per_sender = 1 + random.below(2),
             .max_age = 100ms,
             .protected_bytes_per_s = random.one_in(4) ? 0U : 20'000U}};
  TimePoint now = start;
  for (int step = 0; step < 300; ++step) {
    now +=
        Duration{1ms} * static_cast<Duration::rep>(random.one_in(20) ? random.below(150) : random.below(2));
    const Header header{
        .service = ServiceId{1},
        .method = MethodId{static_cast<std::uint16_t>(random.below(2))},
        .session = SessionId{static_cast<std::uint16_t>(random.one_in(30) ? 0 : 1 + random.below(3))},
        .type = random.one_in(50) ? MessageType::notification : MessageType::tp_notification,
        .return_code = ReturnCode{static_cast<std::uint8_t>(random.below(2))}};
    const bool more = !random.one_in(4);
    const std::size_t slice =
        random.one_in(15) ? random.below(40) : 16 * (1 + random.below(2)) - (more ? 0 : 3);
    Datagram datagram{host(random.below(3), static_cast<std::uint16_t>(1 + random.below(2))), {}};
    datagram.bytes.resize(header_bytes + tp_header_bytes);
    const auto unit = static_cast<std::uint32_t>(random.one_in(40) ? 0x0ffffff0U : random.below(7));
    ASSERT_TRUE(encode_header(header, tp_header_bytes + slice, datagram.bytes));
    const std::uint32_t word = unit * 16 + static_cast<std::uint32_t>(random.below(8)) * 2 + (more ? 1 : 0);
    for (std::size_t i = 0; i < 4; ++i) {
      datagram.bytes[header_bytes + i] = static_cast<std::byte>(word >> (24 - 8 * i));
    }
    const auto filling = random_bytes(random, slice);
    datagram.bytes.insert(datagram.bytes.end(), filling.begin(), filling.end());
    pair.offer(datagram, now);
    ASSERT_LE(pair.reassembler().size(), max_messages);
    ASSERT_FALSE(testing::Test::HasFailure()) << "step " << step;
  }
}
TEST(TpProperty, DoesWhatTheModelDoesOnAnything) {
  covers({"feat_req_someiptp_783", "feat_req_someiptp_792", "feat_req_someiptp_793", "feat_req_someiptp_796",
          "feat_req_someiptp_782", "feat_req_someiptp_795"});
  for_each_seed(does_what_the_model_does);
}

void misses_a_segment(Random random) {
  const auto payload = random_bytes(random, 17 + random.below(400));
  const Header header{.session = SessionId{1}};
  auto wire = segments(host(1), header, payload, 16);
  wire.erase(wire.begin() + static_cast<std::ptrdiff_t>(random.below(wire.size())));
  const auto again = wire;
  wire.insert(wire.end(), again.begin(), again.end());
  random.shuffle(wire);
  Pair pair{1, {.max_message_bytes = 500, .max_per_sender = 1, .max_age = 1s}};
  for (const Datagram& datagram : wire) {
    EXPECT_FALSE(pair.offer(datagram, start));
  }
}
TEST(TpProperty, NeverCompletesAMessageWithASegmentMissing) {
  covers({"feat_req_someiptp_783"});
  for_each_seed(misses_a_segment);
}

TEST(TpDamage, IsRefusedOrLeadsToNothingAtEveryTruncation) {
  covers({"feat_req_someiptp_792"});
  Random random{1};
  const auto payload = random_bytes(random, 40);
  const auto whole = segments(host(1), {.session = SessionId{1}}, payload, 16);
  for (std::size_t damaged = 0; damaged < whole.size(); ++damaged) {
    for (std::size_t size = 0; size < whole[damaged].bytes.size(); ++size) {
      Pair pair{1, {.max_message_bytes = 48, .max_per_sender = 1, .max_age = 1s}};
      auto wire = whole;
      wire[damaged].bytes.resize(size);
      for (const Datagram& datagram : wire) {
        EXPECT_FALSE(pair.offer(datagram, start)) << "segment " << damaged << " cut to " << size;
      }
    }
  }
}

TEST(TpDamage, IsRefusedWhenALengthIsOffByOne) {
  covers({"feat_req_someiptp_792", "feat_req_someiptp_771"});
  Random random{1};
  const auto payload = random_bytes(random, 40);
  const auto whole = segments(host(1), {.session = SessionId{1}}, payload, 16);
  for (std::size_t damaged = 0; damaged < whole.size(); ++damaged) {
    for (const int change : {-1, 1}) {
      Pair pair{1, {.max_message_bytes = 48, .max_per_sender = 1, .max_age = 1s}};
      auto wire = whole;
      auto& length = wire[damaged].bytes[7];
      length = static_cast<std::byte>(std::to_integer<int>(length) + change);
      // A last segment that claims one byte less is a shorter message, and nothing can tell; all else is
      // refused.
      const bool shorter = change < 0 && damaged == whole.size() - 1;
      std::size_t completed = 0;
      for (const Datagram& datagram : wire) {
        if (const auto result = pair.offer(datagram, start)) {
          ++completed;
          EXPECT_EQ(to_hex(*result), to_hex(ByteView{payload}.first(39)));
        }
      }
      EXPECT_EQ(completed, shorter ? 1U : 0U) << damaged << " " << change;
    }
  }
}

}  // namespace
}  // namespace trestle::someip::tp_property_test
