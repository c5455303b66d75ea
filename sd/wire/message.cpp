#include "sd/wire/message.hpp"

#include <limits>

namespace trestle::sd {
using someip::ByteReader;
using someip::ByteWriter;

bool is_sd(const someip::Header& header) noexcept {
  const someip::Header expected = sd_header(header.session);
  return header.service == expected.service && header.method == expected.method &&
         header.protocol == expected.protocol && header.interface_version == expected.interface_version &&
         header.type == expected.type;
}

std::optional<Option> OptionCursor::next() noexcept {
  if (rest_.empty() || error_) {
    return std::nullopt;
  }
  ByteReader in{rest_};
  const std::size_t length = in.u16();
  const OptionType type{in.u8()};
  const ByteView body = in.take(length);  // [feat_req_someipsd_133]
  if (in.failed()) {
    error_ = WireError::bad_option_length;
    return std::nullopt;
  }
  offset_ += in.position();
  rest_ = in.rest();
  return Option{type, body};
}

std::optional<Option> SdMessage::option(std::size_t index) const noexcept {
  if (index >= option_count_) {
    return std::nullopt;
  }
  return OptionCursor{options_.subspan(option_offsets_[index]), 0}.next();
}

Result<Option> SdMessage::option_of(const Entry& entry, std::size_t position) const noexcept {
  assert(position < entry.option_count());
  const bool in_first = position < entry.first_run.count;
  const std::size_t index =
      in_first ? entry.first_run.index + position : entry.second_run.index + position - entry.first_run.count;
  if (const auto found = option(index)) {
    return *found;
  }
  return tl::unexpected{WireError::bad_option_reference};
}

tl::expected<SdMessage, WireFault> decode(ByteView payload) noexcept {
  const auto fail = [](WireError error, std::size_t offset) {
    return tl::unexpected{WireFault{error, offset}};
  };
  ByteReader in{payload};
  SdMessage message;
  const std::uint32_t flags_and_reserved = in.u32();
  message.flags_ = static_cast<std::uint8_t>(flags_and_reserved >> 24U);
  message.reserved_ = flags_and_reserved & 0xff'ffffU;
  const std::size_t entries_length_at = in.position();
  const std::size_t entries_length = in.u32();
  if (in.failed()) {
    return fail(WireError::truncated, in.position());
  }
  message.entries_ = in.take(entries_length);
  if (in.failed() || entries_length % entry_bytes != 0) {
    return fail(WireError::bad_entries_length, entries_length_at);
  }
  const std::size_t options_length_at = in.position();
  const std::size_t options_length = in.u32();
  if (in.failed()) {
    return fail(WireError::truncated, in.position());
  }
  message.options_ = in.take(options_length);
  // SD runs over UDP alone [feat_req_someipsd_27], so no array is longer than a datagram.
  if (in.failed() || options_length > std::numeric_limits<std::uint16_t>::max()) {
    return fail(WireError::bad_options_length, options_length_at);
  }
  message.trailing_ = in.rest();
  OptionCursor cursor{message.options_, 0};
  for (std::size_t offset = 0; message.option_count_ < SdMessage::addressable_options && cursor.next();
       offset = cursor.offset()) {
    message.option_offsets_[message.option_count_++] = static_cast<std::uint16_t>(offset);
  }
  return message;
}

tl::expected<SdMessage, WireFault> decode(const someip::Message& message) noexcept {
  if (!is_sd(message.header)) {
    return tl::unexpected{WireFault{WireError::not_sd, 0}};
  }
  return decode(message.payload);
}

std::optional<WireFault> find_fault(const SdMessage& message) noexcept {
  for (std::size_t i = 0; i < message.entry_count(); ++i) {
    const Entry entry = message.entry(i);
    if (entry.kind() == EntryKind::unknown) {
      return WireFault{WireError::bad_entry_type, SdMessage::entry_offset(i)};
    }
    for (std::size_t position = 0; position < entry.option_count(); ++position) {
      if (const auto option = message.option_of(entry, position); !option) {
        return WireFault{option.error(), SdMessage::entry_offset(i)};
      }
    }
  }
  OptionCursor cursor = message.options();
  std::size_t offset = cursor.offset();
  while (const auto option = cursor.next()) {
    if (const auto error = find_fault(*option)) {
      return WireFault{*error, offset};
    }
    offset = cursor.offset();
  }
  if (cursor.error()) {
    return WireFault{*cursor.error(), cursor.offset()};
  }
  return std::nullopt;
}

Result<ByteView> encode(const SdMessage& message, ByteSpan room) noexcept {
  ByteWriter out{room};
  out.u32((std::uint32_t{message.flags()} << 24U) | message.reserved());
  out.u32(static_cast<std::uint32_t>(message.entry_count() * entry_bytes));
  for (std::size_t i = 0; i < message.entry_count(); ++i) {
    if (const ByteSpan place = out.reserve(entry_bytes); !place.empty()) {
      encode(message.entry(i), place.first<entry_bytes>());
    }
  }
  const ByteSpan options_length = out.reserve(4);
  const std::size_t options_begin = out.position();
  OptionCursor cursor = message.options();
  while (const auto option = cursor.next()) {
    out.u16(static_cast<std::uint16_t>(option->body.size()));
    out.u8(static_cast<std::uint8_t>(option->type));
    out.bytes(option->body);
  }
  if (cursor.error()) {
    return tl::unexpected{*cursor.error()};
  }
  if (!options_length.empty()) {
    someip::store(options_length.data(), static_cast<std::uint32_t>(out.position() - options_begin));
  }
  out.bytes(message.trailing());
  if (out.failed()) {
    return tl::unexpected{WireError::no_room};
  }
  return ByteView{out.written()};
}

}  // namespace trestle::sd
