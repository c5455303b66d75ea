#pragma once
#include <optional>
#include <string_view>
#include <utility>

#include "someip/wire/bytes.hpp"
#include "someip/wire/header.hpp"
#include "someip/wire/payload_rules.hpp"
#include "someip/wire/tag.hpp"

namespace trestle::someip {

/// Reads the parameters of a message, one after another as the interface lists them.
///
///     PayloadReader in{message.payload, rules};
///     const std::uint8_t id = in.u8();
///     const std::string_view frame = in.string(room_for_utf16);
///     auto points = in.begin_array();
///     while (in.more(points)) { const auto point = in.begin_struct(); x = in.f32(); in.end(point); }
///     in.end(points);
///     if (in.error()) { ... }
///
/// Every length is checked against the bytes there are before it is used. The first failure fails the reader
/// for good: what is read after it is zero or empty and more() is false, so error() is the only thing to
/// test. Bytes after the last parameter read are left alone.  [feat_req_someip_168]
///
/// Parameters that an older sender does not have yet are missing at the end of the message, or of a struct
/// with a length field: `const auto unit = in.at_end() ? metres : in.u8();`.  [feat_req_someipcompat_1200]
/// Tagged members may come in any order, or not at all:
///
///     while (const auto id = in.next_member()) {
///       if (*id == DataId{1}) { speed = in.f32(); }
///       if (*id == DataId{2}) { const auto place = in.begin_struct(); ...; in.end(place); }
///     }                                                       // what is not read is skipped
///
/// The errors are
///     WireError::truncated            the payload ends before the element does;
///     WireError::bad_length           a length field contradicts its contents or what holds it;
///     WireError::bad_string_encoding  no BOM or terminator where the rules demand them, text
///                                     that is not valid Unicode, or bytes other than zero
///                                     behind the terminator;
///     WireError::bad_union_type       a type that names no member;
///     WireError::bad_tag              a member whose wire type is not that of what is read;
///     WireError::no_room              the caller's room for a string is too small.
class PayloadReader {
 public:
  /// An element that has begun; its length field, if it has one, bounds what is read until it ends.
  class Open {
   private:
    friend class PayloadReader;
    std::size_t end_ = 0;            ///< where the contents end, if a length field says so
    std::size_t outer_limit_ = 0;    ///< what bounded the reader before
    std::size_t last_position_ = 0;  ///< at the last more()
    bool bounded_ = false;
    bool extensible_ = false;  ///< surplus bytes are skipped; otherwise they are an error
    bool variable_ = false;    ///< followed by padding where the rules align
  };

  explicit PayloadReader(ByteView payload, const PayloadRules& rules = {}) noexcept
      : payload_{payload}, rules_{rules}, number_order_{rules.byte_order}, limit_{payload.size()} {}

  /// From here on numbers have this byte order: see PayloadWriter::byte_order().  [feat_req_someip_224]
  /// @return the byte order before.
  std::endian byte_order(std::endian order) noexcept { return std::exchange(number_order_, order); }

  /// Only the lowest bit counts.  [feat_req_someip_817]
  bool boolean() noexcept { return (u8() & 1U) != 0; }
  std::uint8_t u8() noexcept { return number<std::uint8_t>(); }
  std::uint16_t u16() noexcept { return number<std::uint16_t>(); }
  std::uint32_t u32() noexcept { return number<std::uint32_t>(); }
  std::uint64_t u64() noexcept { return number<std::uint64_t>(); }
  std::int8_t i8() noexcept { return static_cast<std::int8_t>(u8()); }
  std::int16_t i16() noexcept { return static_cast<std::int16_t>(u16()); }
  std::int32_t i32() noexcept { return static_cast<std::int32_t>(u32()); }
  std::int64_t i64() noexcept { return static_cast<std::int64_t>(u64()); }
  float f32() noexcept { return std::bit_cast<float>(u32()); }
  double f64() noexcept { return std::bit_cast<double>(u64()); }
  /// The next `size` bytes, as a view into the payload.
  ByteView bytes(std::size_t size) noexcept;
  /// An array of uint8 of any size, as a view into the payload.
  ByteView byte_array() noexcept;

  /// A string with a length field, in UTF-8, without BOM and terminator. It points into the payload if that
  /// is in UTF-8, else into `room`; 3 bytes there for 2 bytes in the payload always suffice.
  std::string_view string(std::span<char> room) noexcept { return string(room, rules_.string_encoding); }
  /// One that the interface wants in another encoding than the rules say.  [feat_req_someip_235]
  std::string_view string(std::span<char> room, StringEncoding encoding) noexcept;
  /// A string in exactly `size` bytes.
  std::string_view fixed_string(std::size_t size, std::span<char> room) noexcept;

  /// An array of any size. Elements that are left unread when it ends are skipped, or an error where the
  /// rules say so.  [feat_req_someipcompat_1199]
  [[nodiscard]] Open begin_array() noexcept {
    return begin(rules_.array_length, rules_.cut_longer_arrays, true);
  }
  /// An array whose size the interface fixes; the same goes for it where it has a length field.
  [[nodiscard]] Open begin_fixed_array() noexcept {
    return begin(rules_.fixed_array_length, rules_.cut_longer_arrays, false);
  }
  /// A struct; bytes of it that are left unread when it ends are skipped.  [feat_req_someip_601]
  [[nodiscard]] Open begin_struct() noexcept { return begin(rules_.struct_length, true, false); }

  struct Union;
  /// A union; its padding is skipped when it ends.  [feat_req_someip_274]
  /// @param members  how many the interface lists. Other types are errors, and so is 0 for "none" unless the
  ///                 rules allow it.  [feat_req_someip_273]
  /// @param longest  size of the longest member; to be given when unions have no length field.
  [[nodiscard]] Union begin_union(std::uint32_t members, std::size_t longest = 0) noexcept;

  /// Whether the array has further elements. Without a length field it goes on to the end of what holds it.
  /// Elements that take no bytes are an error, or a length field could keep the caller busy forever.
  [[nodiscard]] bool more(Open& array) noexcept;
  /// Bytes left in the element; only if it has a length field. Bounds the number of its elements.
  [[nodiscard]] std::size_t rest(const Open& element) const noexcept {
    return error_ || !element.bounded_ ? 0 : element.end_ - position_;
  }
  /// Whether nothing is left of the innermost element with a length field, or payload. False after a failure.
  [[nodiscard]] bool at_end() const noexcept { return !error_ && position_ == limit_; }
  /// Moves on to the next tagged member of what is being read, past the one before if that was not read.
  /// @return which it is; nothing at the end, and after a failure.
  [[nodiscard]] std::optional<DataId> next_member() noexcept;

  /// Ends the element that began last.
  void end(const Open& element) noexcept;

  [[nodiscard]] std::optional<WireError> error() const noexcept { return error_; }
  /// How many bytes have been read. After a failure: where what failed began.
  [[nodiscard]] std::size_t position() const noexcept { return position_; }

 private:
  template <std::unsigned_integral T>
  T number() noexcept {
    if (member_) {
      expect_number(sizeof(T));
    }
    const ByteView bytes = take(sizeof(T));
    return bytes.empty() ? T{0} : load<T>(bytes.data(), number_order_);
  }
  void expect_number(std::size_t bytes) noexcept;
  ByteView take(std::size_t size) noexcept;
  void fail(WireError error) noexcept;
  Open begin(FieldWidth width, bool extensible, bool variable) noexcept;
  void bound(Open& open, std::size_t size) noexcept;
  std::size_t field(FieldWidth width) noexcept;
  std::string_view read_text(ByteView bytes, bool fixed, StringEncoding encoding,
                             std::span<char> room) noexcept;
  std::string_view utf16_text(ByteView characters, std::endian order, std::span<char> room) noexcept;

  ByteView payload_;
  PayloadRules rules_;
  std::endian number_order_;
  std::size_t position_ = 0;
  std::size_t limit_;  ///< where the innermost element with a length field ends
  std::optional<WireError> error_;
  std::optional<WireType> member_;  ///< of the tagged member that is to be read next
};

/// A union that has begun: which member it holds, counted from 1; 0 when it is empty, and after a failure.
struct PayloadReader::Union {
  std::uint32_t type = 0;
  Open open;
};

}  // namespace trestle::someip
