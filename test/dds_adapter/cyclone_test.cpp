#include "test/dds_adapter/cyclone_peer.hpp"

#include <gmock/gmock.h>

#include <algorithm>
#include <array>
#include <cstring>
#include <optional>
#include <span>
#include <thread>

#include "test/bytes.hpp"
#include "test/dds_adapter/dds_test.hpp"

namespace trestle::dds::cyclone_test {
namespace {

using test::Blob;
using test::blob_topic;
using test::blob_type;
using test::copy;
using test::CyclonePeer;
using test::eventually;
using test::hex;
using test::Inbox;
using test::to_hex;
using Bytes = std::vector<std::byte>;
using Cyclone = test::DdsTest;

constexpr Qos kept{.reliable = true, .transient_local = true, .depth = 2};

/// A blob as little-endian XCDR1, written down by hand from the type; `text` has 3 characters.
Bytes cdr_of(const Blob& blob) {
  Bytes bytes = hex("00010000");
  const auto number = [&](std::size_t value) {
    for (unsigned shift = 0; shift < 32; shift += 8) {
      bytes.push_back(static_cast<std::byte>(value >> shift));
    }
  };
  number(blob.number);
  number(blob.text.size() + 1);
  for (const char letter : blob.text) {
    bytes.push_back(static_cast<std::byte>(letter));
  }
  bytes.push_back(std::byte{0});
  number(blob.data.size());
  bytes.insert(bytes.end(), blob.data.begin(), blob.data.end());
  return bytes;
}

Blob blob_of_size(std::size_t size, std::uint32_t number) {
  return {number, "abc", test::make_sample(size, number)};
}

std::optional<Blob> next(CyclonePeer& peer) {
  std::optional<Blob> blob;
  eventually([&] {
    blob = peer.take();
    return blob.has_value();
  });
  return blob;
}

/// Again and again until it is there: a volatile reader of Cyclone may skip what is written in the moment in
/// which the two find each other.
std::optional<Blob> written_and_read(Writer& writer, std::span<const ByteView> slices, CyclonePeer& peer) {
  std::optional<Blob> blob;
  eventually([&] {
    EXPECT_TRUE(writer.write(slices));
    blob = peer.take();
    return blob.has_value();
  });
  return blob;
}

TEST_F(Cyclone, ReadsTheBytesThatWeWrite) {
  CyclonePeer peer{domain_.id()};
  peer.open_reader({});
  Participant participant{config()};
  Writer writer = participant.create_writer(blob_topic, blob_type, {});
  ASSERT_TRUE(eventually([&] { return writer.matched() == 1 && peer.writers_matched() == 1; }));

  const Bytes sample = hex("00010000 2a000000 04000000 61626300 03000000 010203");
  EXPECT_EQ(written_and_read(writer, std::array{ByteView{sample}}, peer), (Blob{42, "abc", hex("010203")}));
}

TEST_F(Cyclone, ReadsOurBigEndianBytesToo) {
  CyclonePeer peer{domain_.id()};
  peer.open_reader({});
  Participant participant{config()};
  Writer writer = participant.create_writer(blob_topic, blob_type, {});
  ASSERT_TRUE(eventually([&] { return writer.matched() == 1 && peer.writers_matched() == 1; }));

  const Bytes sample = hex("00000000 0000002a 00000004 61626300 00000003 010203");
  EXPECT_EQ(written_and_read(writer, std::array{ByteView{sample}}, peer), (Blob{42, "abc", hex("010203")}));
}

TEST_F(Cyclone, ReadsASampleThatWeWriteInSlices) {
  CyclonePeer peer{domain_.id()};
  peer.open_reader({});
  Participant participant{config()};
  Writer writer = participant.create_writer(blob_topic, blob_type, {});
  ASSERT_TRUE(eventually([&] { return writer.matched() == 1 && peer.writers_matched() == 1; }));

  const Bytes header = hex("0001");
  const Bytes front = hex("0000 2a000000 04000000 616263");
  const Bytes back = hex("00 03000000 010203");
  const std::array<ByteView, 4> slices{header, front, ByteView{}, back};
  EXPECT_EQ(written_and_read(writer, slices, peer), (Blob{42, "abc", hex("010203")}));
}

TEST_F(Cyclone, WritesBytesThatWeReadUnchanged) {
  CyclonePeer peer{domain_.id()};
  peer.open_writer({});
  Participant participant{config()};
  Inbox<std::string> inbox;
  const Reader reader = participant.create_reader(
      blob_topic, blob_type, {}, [&](const Sample& sample) { inbox.put(to_hex(sample.cdr())); });
  ASSERT_TRUE(eventually([&] { return reader.matched() == 1 && peer.readers_matched() == 1; }));

  peer.write({42, "abc", hex("010203")});
  ASSERT_TRUE(inbox.wait_for_count(1));
  // Cyclone says in the options how many bytes of padding it has added.
  EXPECT_EQ(inbox.take()[0],
            "000100012a0000000400000061626300"
            "0300000001020300");
}

TEST_F(Cyclone, ExchangesSixteenMegabytesBothWays) {
  // A volatile reader of Cyclone takes a sample that is still arriving when the first heartbeat comes for one
  // from before its time, and skips it.
  CyclonePeer peer{domain_.id()};
  peer.open_reader(kept);
  peer.open_writer(kept);
  Participant participant{config()};
  Writer writer = participant.create_writer(blob_topic, blob_type, kept);
  Inbox<Bytes> inbox;
  const Reader reader = participant.create_reader(
      blob_topic, blob_type, {}, [&](const Sample& sample) { inbox.put(copy(sample.cdr())); });
  // The peer's own reader and writer match, too.
  ASSERT_TRUE(eventually([&] {
    return writer.matched() == 1 && reader.matched() == 1 && peer.readers_matched() == 2 &&
           peer.writers_matched() == 2;
  }));

  for (std::uint32_t i = 0; i < 3; ++i) {
    const Blob blob = blob_of_size(std::size_t{16} << 20U, i);
    ASSERT_TRUE(writer.write(cdr_of(blob)));
    EXPECT_TRUE(next(peer) == blob) << i;
    peer.write(blob);
    ASSERT_TRUE(inbox.wait_for_count(1));
    EXPECT_TRUE(inbox.take()[0] == cdr_of(blob)) << i;
    EXPECT_TRUE(next(peer) == blob) << i;
  }
}

TEST_F(Cyclone, GetsWhatWasWrittenBeforeItCame) {
  Participant participant{config()};
  Writer writer = participant.create_writer(blob_topic, blob_type, kept);
  for (std::uint32_t i = 1; i <= 3; ++i) {
    ASSERT_TRUE(writer.write(cdr_of(blob_of_size(100'000, i))));
  }
  CyclonePeer peer{domain_.id()};
  peer.open_reader(kept);
  EXPECT_EQ(next(peer), blob_of_size(100'000, 2));
  EXPECT_EQ(next(peer), blob_of_size(100'000, 3));
}

TEST_F(Cyclone, WroteThingsBeforeWeCame) {
  CyclonePeer peer{domain_.id()};
  peer.open_writer(kept);
  for (std::uint32_t i = 1; i <= 3; ++i) {
    peer.write(blob_of_size(100'000, i));
  }
  Participant participant{config()};
  Inbox<Bytes> inbox;
  const Reader reader = participant.create_reader(
      blob_topic, blob_type, kept, [&](const Sample& sample) { inbox.put(copy(sample.cdr())); });
  ASSERT_TRUE(inbox.wait_for_count(2));
  const auto received = inbox.take();
  EXPECT_EQ(received[0], cdr_of(blob_of_size(100'000, 2)));
  EXPECT_EQ(received[1], cdr_of(blob_of_size(100'000, 3)));
}

TEST_F(Cyclone, IsToldApartByQualityOfServiceByName) {
  Inbox<Happening> events;
  Participant participant{config([&](const Happening& event) { events.put(event); })};
  const Reader reader = participant.create_reader(
      blob_topic, blob_type, {.reliable = true, .transient_local = true, .depth = 1}, [](const Sample&) {});
  CyclonePeer peer{domain_.id()};
  peer.open_writer({.reliable = false, .transient_local = false, .depth = 1});
  ASSERT_TRUE(events.wait([](const auto& all) {
    return std::ranges::any_of(
        all, [](const Happening& event) { return event.kind == Happening::Kind::incompatible_qos; });
  }));
  for (const Happening& event : events.take()) {
    EXPECT_NE(event.kind, Happening::Kind::matched);
    if (event.kind == Happening::Kind::incompatible_qos) {
      EXPECT_EQ(event.topic, blob_topic);
      EXPECT_EQ(event.detail, "durability, reliability");
    }
  }
  EXPECT_TRUE(eventually([&] { return reader.counters().incompatible_qos == 1; }));
  EXPECT_EQ(reader.matched(), 0U);
}

}  // namespace
}  // namespace trestle::dds::cyclone_test
