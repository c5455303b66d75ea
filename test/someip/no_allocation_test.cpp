// The core allocates nothing once it is constructed: every use of operator new in this program is counted.
#include <gtest/gtest.h>

#include <array>
#include <cstdint>
#include <cstdlib>
#include <new>

#include "someip/core/call_table.hpp"
#include "someip/core/e2e/checker.hpp"
#include "someip/core/e2e/protector.hpp"
#include "someip/core/session_counter.hpp"
#include "someip/core/stream_parser.hpp"
#include "someip/core/tp_reassembler.hpp"
#include "someip/core/tp_segmenter.hpp"
#include "someip/wire/payload_reader.hpp"
#include "someip/wire/payload_writer.hpp"
#include "test/allocations.hpp"

namespace trestle::someip::no_allocation_test {
namespace {
using namespace std::chrono_literals;
using test::allocations_of;

TEST(NoAllocation, IsCountedWhereThereIsOne) {
  EXPECT_EQ(allocations_of([] { operator delete(operator new(8)); }), 1U);
  EXPECT_EQ(allocations_of([] { operator delete[](operator new[](8)); }), 1U);
  EXPECT_EQ(allocations_of([] { operator delete(operator new(8, std::nothrow)); }), 1U);
  constexpr std::align_val_t line{64};
  EXPECT_EQ(allocations_of([] { operator delete(operator new(8, line), line); }), 1U);
  EXPECT_EQ(allocations_of([] { operator delete[](operator new[](8, line), line); }), 1U);
  EXPECT_EQ(allocations_of([] { operator delete(operator new(8, line, std::nothrow), line); }), 1U);
  void* const aligned = operator new(8, line);
  EXPECT_EQ(reinterpret_cast<std::uintptr_t>(aligned) % 64, 0U);
  operator delete(aligned, line);
}

TEST(NoAllocation, IsCountedInTheCLibrary) {
  if (!test::malloc_is_counted()) {
    GTEST_SKIP() << "only where neither a sanitizer nor a board is in the way";
  }
  void* memory = nullptr;
  const auto taken = [&](auto get) {
    const std::size_t number = allocations_of([&] { memory = get(); });
    EXPECT_NE(memory, nullptr);
    std::free(memory);  // NOLINT(*-no-malloc)
    return number;
  };
  EXPECT_EQ(taken([] { return std::malloc(8); }), 1U);            // NOLINT(*-no-malloc)
  EXPECT_EQ(taken([] { return std::calloc(2, 8); }), 1U);         // NOLINT(*-no-malloc)
  EXPECT_EQ(taken([] { return std::realloc(nullptr, 8); }), 1U);  // NOLINT(*-no-malloc)
}

TEST(NoAllocation, HappensInTheHeaderCodec) {
  std::array<std::byte, 64> room{};
  bool decoded = false;
  EXPECT_EQ(allocations_of([&] {
              SessionCounter sessions;
              const Header header{.service = ServiceId{1}, .session = sessions.next()};
              const auto bytes = encode(header, ByteView{room}.subspan(32, 8), ByteSpan{room}.first(24));
              for (MessageCursor cursor{*bytes}; const auto message = cursor.next();) {
                decoded = message->header == header;
              }
            }),
            0U);
  EXPECT_TRUE(decoded);
}

TEST(NoAllocation, HappensInEndToEndProtection) {
  std::array<std::byte, 64> data{};
  e2e::CheckStatus status = e2e::CheckStatus::error;
  EXPECT_EQ(allocations_of([&] {
              auto protector = e2e::Protector::create(e2e::Profile7{.data_id = 1});
              auto checker = e2e::Checker::create(e2e::Profile7{.data_id = 1});
              static_cast<void>(protector->protect(data));
              status = checker->check(data).status;
            }),
            0U);
  EXPECT_EQ(status, e2e::CheckStatus::ok);
}

TEST(NoAllocation, HappensInSegmentationAndReassembly) {
  static std::array<std::byte, 1U << 16U> payload{};
  static std::array<std::byte, 1U << 16U> buffer{};
  std::array<std::uint32_t, tp_map_words(buffer.size())> map{};
  std::array<TpSlot, 1> slots{TpSlot{buffer, map}};
  std::array<std::byte, 1500> datagram{};
  std::size_t completed = 0;
  EXPECT_EQ(allocations_of([&] {
              TpReassembler reassembler{
                  slots, {.max_message_bytes = buffer.size(), .max_per_sender = 1, .max_age = 1s}};
              for (const std::uint16_t session : {std::uint16_t{1}, std::uint16_t{2}}) {
                const Header header{.session = SessionId{session}, .type = MessageType::notification};
                for (TpSegmenter segments{header, payload.size()}; const auto segment = segments.next();) {
                  ByteWriter out{datagram};
                  out.bytes(segment->header);
                  out.bytes(ByteView{payload}.subspan(segment->offset, segment->bytes));
                  const auto outcome = reassembler.on_segment({}, *decode(out.written()), TimePoint{});
                  completed += outcome && *outcome ? 1 : 0;
                }
              }
              reassembler.on_time(TimePoint{} + 2s);
            }),
            0U);
  EXPECT_EQ(completed, 2U);
}

TEST(NoAllocation, HappensInCallsOverAStream) {
  std::array<CallSlot, 4> slots;
  std::array<std::byte, 64> buffer{};
  std::array<std::byte, 64> room{};
  std::size_t answered = 0;
  EXPECT_EQ(allocations_of([&] {
              CallTable calls{slots, ClientId{1}};
              StreamParser parser{buffer};
              for (int i = 0; i < 10; ++i) {
                Header header = calls.start({}, ServiceId{1}, MethodId{2}, 1, 1s, TimePoint{})->header;
                header.type = MessageType::response;
                const ByteView stream = *encode(header, ByteView{room}.subspan(32, 8), room);
                for (const ByteView chunk : {stream.first(19), stream.subspan(19)}) {
                  parser.feed(chunk);
                  while (const auto message = parser.next()) {
                    answered += calls.on_answer({}, message->header) ? 1 : 0;
                  }
                }
              }
              static_cast<void>(calls.start({}, ServiceId{1}, MethodId{2}, 1, 1s, TimePoint{}));
              calls.on_time(TimePoint{} + 2s, [&](CallHandle) { ++answered; });
            }),
            0U);
  EXPECT_EQ(answered, 11U);
}

TEST(NoAllocation, HappensInThePayloadWriterAndReader) {
  std::array<std::byte, 256> room{};
  std::array<char, 64> text{};
  bool equal = false;
  EXPECT_EQ(allocations_of([&] {
              const PayloadRules rules{.struct_length = FieldWidth::bits16,
                                       .string_encoding = StringEncoding::utf16le,
                                       .alignment = 8};
              PayloadWriter out{room, rules};
              const auto outer = out.begin_struct();
              out.string("a string that is longer than any small string optimisation");
              const auto array = out.begin_array();
              out.f64(1.5);
              out.end(array);
              out.end(outer);
              PayloadReader in{*out.finish(), rules};
              const auto read = in.begin_struct();
              equal = in.string(text) == "a string that is longer than any small string optimisation";
              auto elements = in.begin_array();
              while (in.more(elements)) {
                equal = equal && in.f64() == 1.5;
              }
              in.end(elements);
              in.end(read);
              equal = equal && !in.error();
            }),
            0U);
  EXPECT_TRUE(equal);
}

}  // namespace
}  // namespace trestle::someip::no_allocation_test
