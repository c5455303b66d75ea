#pragma once
#include <optional>
#include <string_view>
#include <utility>

#include "someip/wire/bytes.hpp"
#include "someip/wire/header.hpp"
#include "someip/wire/payload_rules.hpp"
#include "someip/wire/tag.hpp"

namespace trestle::someip {

/// Serialises the parameters of a message, one after another as the interface lists them, into a buffer.
/// [feat_req_someip_169] [feat_req_someip_230]
///
///     PayloadWriter out{room, rules};
///     out.u8(7);
///     out.string("map");
///     const auto points = out.begin_array();
///     for (...) { const auto point = out.begin_struct(); out.f32(x); out.f32(y); out.end(point); }
///     out.end(points);
///     const Result<ByteView> payload = out.finish();
///
/// The first failure fails the writer for good: finish() is the only thing to test. Nothing is allocated.
class PayloadWriter {
 public:
  /// An element that has begun, perhaps with a length field to be filled in when it ends.
  class Open {
   private:
    friend class PayloadWriter;
    ByteSpan length_;  ///< where the length field goes; empty without one
    std::size_t start_ = 0;
    std::size_t contents_at_ = 0;
    std::size_t padded_bytes_ = 0;
    bool variable_ = false;
    bool is_element_ = false;  ///< of an array of any size
    bool shrinks_ = false;     ///< the length field becomes the smallest that does, and the tag says which
    DataId id_{};              ///< if so
  };

  explicit PayloadWriter(ByteSpan room, const PayloadRules& rules = {}) noexcept
      : room_{room}, rules_{rules}, number_order_{rules.byte_order} {}

  /// From here on numbers have this byte order, for parameters whose order is not that of the rules; length
  /// and type fields keep that of the rules.  [feat_req_someip_224]
  /// @return the byte order before, to go back to:
  ///         `const auto before = out.byte_order(std::endian::little); out.u32(id); out.byte_order(before);`
  std::endian byte_order(std::endian order) noexcept { return std::exchange(number_order_, order); }

  /// Puts a tag before the element that is written next: `out.tagged(DataId{3}).u16(speed)`. Optional members
  /// that are not there are just not written. Fails with WireError::bad_tag when the id is too large, no
  /// element follows that can have a tag, or the rules align.
  PayloadWriter& tagged(DataId id) noexcept;

  void boolean(bool state) noexcept { put(std::uint8_t{state}); }  // [feat_req_someip_817]
  void u8(std::uint8_t number) noexcept { put(number); }
  void u16(std::uint16_t number) noexcept { put(number); }
  void u32(std::uint32_t number) noexcept { put(number); }
  void u64(std::uint64_t number) noexcept { put(number); }
  void i8(std::int8_t number) noexcept { put(static_cast<std::uint8_t>(number)); }
  void i16(std::int16_t number) noexcept { put(static_cast<std::uint16_t>(number)); }
  void i32(std::int32_t number) noexcept { put(static_cast<std::uint32_t>(number)); }
  void i64(std::int64_t number) noexcept { put(static_cast<std::uint64_t>(number)); }
  void f32(float number) noexcept { put(std::bit_cast<std::uint32_t>(number)); }
  void f64(double number) noexcept { put(std::bit_cast<std::uint64_t>(number)); }
  /// Bytes as they are.
  void bytes(ByteView bytes) noexcept;
  /// An array of uint8 of any size.
  void byte_array(ByteView elements) noexcept;

  /// A string of any length, given in UTF-8. Fails with WireError::bad_string_encoding when it is not valid
  /// UTF-8, or holds a zero although its end is marked by one.  [feat_req_someip_237]
  void string(std::string_view text) noexcept { string(text, rules_.string_encoding); }
  /// One that the interface wants in another encoding than the rules say.  [feat_req_someip_235]
  void string(std::string_view text, StringEncoding encoding) noexcept;
  /// A string in exactly `size` bytes, filled up with zeros; without a length field. Fails with
  /// WireError::bad_length when BOM, text and terminator take more.  [feat_req_someip_233]
  void fixed_string(std::string_view text, std::size_t size) noexcept;

  /// Between begin and end stand the elements, each of a byte at least: nothing else tells how many there
  /// are. [feat_req_someip_254] [feat_req_someip_257]
  [[nodiscard]] Open begin_array() noexcept {
    const Open array = begin(rules_.array_length, true);
    in_array_ = true;
    return array;
  }
  /// An array whose size the interface fixes.  [feat_req_someip_241] [feat_req_someip_621]
  [[nodiscard]] Open begin_fixed_array() noexcept { return begin(rules_.fixed_array_length, false); }
  /// [feat_req_someip_600] [feat_req_someip_602]
  [[nodiscard]] Open begin_struct() noexcept { return begin(rules_.struct_length, false); }
  /// Between begin and end stands the one member.  [feat_req_someip_264]
  /// @param type     which member, counted from 1 in the interface's order; 0 for none where the rules allow
  ///                 that.  [feat_req_someip_273]
  /// @param longest  size of the longest member, to which the data is padded with zeros; to be given when
  ///                 unions have no length field.  [feat_req_someip_572] [feat_req_someip_583]
  [[nodiscard]] Open begin_union(std::uint32_t type, std::size_t longest = 0) noexcept;
  /// Ends the element that began last. Fails with WireError::bad_length when the contents are longer than the
  /// length field, or `longest`, can say; or when an element of an array took no bytes.
  void end(const Open& element) noexcept;

  /// @return what was written, at the front of the buffer, or
  ///         WireError::no_room              the buffer is too small;
  ///         WireError::bad_length           contents too long for their length field or their fixed size;
  ///         WireError::bad_union_type       a type that does not fit its field, or a 0 that is not allowed;
  ///         WireError::bad_tag              see tagged();
  ///         WireError::bad_string_encoding  see string().
  [[nodiscard]] Result<ByteView> finish() const noexcept;

  /// How many bytes have been written.
  [[nodiscard]] std::size_t position() const noexcept { return position_; }

 private:
  template <std::unsigned_integral T>
  void put(T number) noexcept {
    if (tag_) {
      put_tag(number_type(sizeof(T)));
    }
    const ByteSpan place = reserve(sizeof(T));
    if (!place.empty()) {
      store(place.data(), number, number_order_);
    }
  }
  /// The tag that tagged() asked for.
  void put_tag(WireType type) noexcept;
  /// Moves the contents of a tagged element to behind the smallest length field that does.
  ByteSpan shrink(const Open& element) noexcept;
  /// Room for the next `size` bytes; empty when there is none.
  ByteSpan reserve(std::size_t size) noexcept;
  void zeros(std::size_t size) noexcept;
  void fail(WireError error) noexcept;
  Open begin(FieldWidth width, bool variable) noexcept;
  Open begin_tagged() noexcept;
  /// Writes a length or type field of 0, 1, 2 or 4 bytes.
  void put_field(ByteSpan place, std::size_t number, WireError overflow) noexcept;
  /// BOM, characters and terminator.
  void put_text(std::string_view text, StringEncoding encoding) noexcept;

  ByteSpan room_;
  PayloadRules rules_;
  std::endian number_order_;
  std::size_t position_ = 0;
  std::optional<WireError> error_;
  std::optional<DataId> tag_;  ///< of the element that comes next
  bool in_array_ = false;      ///< of any size: what comes next is an element of it
};

}  // namespace trestle::someip
