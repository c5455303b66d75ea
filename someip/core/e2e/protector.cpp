#include "someip/core/e2e/protector.hpp"

#include "someip/wire/enumerator_name.hpp"

namespace trestle::someip::e2e {

const char* to_string(ProtectError error) noexcept {
  static constexpr std::array names{"too_short", "too_long", "header_in_front", "source_id"};
  return enumerator_name<ProtectError::source_id>(names, error, "?");
}

tl::expected<Protector, ConfigError> Protector::create(const Config& config) noexcept {
  const auto layout = make_layout(config);
  if (!layout) {
    return tl::unexpected{layout.error()};
  }
  return Protector{*layout};
}

tl::expected<void, ProtectError> Protector::protect(ByteView front, ByteSpan data,
                                                    const MethodInfo& method) noexcept {
  const std::size_t bytes = front.size() + data.size();
  if (bytes < layout_.min_bytes) {
    return tl::unexpected{ProtectError::too_short};
  }
  if (bytes > layout_.max_bytes) {
    return tl::unexpected{ProtectError::too_long};
  }
  if (layout_.header_at() < front.size()) {
    return tl::unexpected{ProtectError::header_in_front};
  }
  if (layout_.source.size != 0 && method.source_id > 0x0fffffff) {
    return tl::unexpected{ProtectError::source_id};
  }
  const std::uint32_t source =
      (method.response ? 1U << 30U : 0U) | (method.error ? 1U << 28U : 0U) | method.source_id;
  write_field(layout_.length, data, front.size(), bytes);
  write_field(layout_.counter, data, front.size(), counter_);
  write_field(layout_.data_id, data, front.size(), layout_.id);
  write_field(layout_.data_id_nibble, data, front.size(), layout_.id >> 8U);
  write_field(layout_.source, data, front.size(), source);
  write_field(layout_.crc, data, front.size(), checksum(layout_, front, data, counter_), layout_.crc_order);
  counter_ = layout_.next(counter_);
  return {};
}

void Protector::resume(std::uint32_t next_counter) noexcept {
  counter_ = layout_.counter_max == 0xffffffff ? next_counter : next_counter % (layout_.counter_max + 1);
}

}  // namespace trestle::someip::e2e
