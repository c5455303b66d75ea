#include "someip/core/e2e/layout.hpp"

#include <algorithm>

#include "someip/core/e2e/crc.hpp"
#include "someip/core/e2e/requirements.hpp"
#include "someip/wire/bytes.hpp"

namespace trestle::someip::e2e {
namespace {

constexpr std::uint32_t offset_limit = 0x00ffffff;  ///< bits; keeps the sums below from wrapping
constexpr std::string_view whole_bytes = "a multiple of 8, at most 0xffffff";

/// Where the last field ends, in bits.
std::uint32_t fields_end(const Layout& l) noexcept {
  return std::max({l.crc.end(), l.counter.end(), l.length.end(), l.data_id.end(), l.data_id_nibble.end(),
                   l.source.end()});
}

void require_offset(Requirements& rules, std::uint32_t bits, std::string_view field) {
  rules.require(bits % 8 == 0 && bits <= offset_limit, field, whole_bytes);
}

/// For the profiles of a single length.
void set_fixed_length(Layout& l, Requirements& rules, std::uint32_t data_bits, std::uint32_t limit_bits) {
  rules.require(data_bits % 8 == 0 && data_bits <= limit_bits, "data_bits",
                limit_bits == 240 ? "a multiple of 8, at most 240" : "a multiple of 8, at most 32768");
  rules.require(data_bits >= fields_end(l), "data_bits", "long enough for the E2E header at its offset");
  l.min_bytes = l.max_bytes = data_bits / 8;
}

/// For the profiles with a length field.
void set_length_range(Layout& l, Requirements& rules, std::uint32_t min_bits, std::uint32_t max_bits,
                      std::uint32_t limit_bits) {
  const std::uint32_t needed = fields_end(l);
  rules.require(min_bits % 8 == 0 && (min_bits == 0 || min_bits >= needed), "min_data_bits",
                "a multiple of 8, and 0 or long enough for the E2E header at its offset");
  rules.require(max_bits % 8 == 0 && max_bits <= limit_bits, "max_data_bits",
                "a multiple of 8 that the profile's length field can hold");
  rules.require(max_bits >= std::max(min_bits, needed), "max_data_bits",
                "at least min_data_bits and long enough for the E2E header at its offset");
  l.min_bytes = std::max(min_bits, needed) / 8;
  l.max_bytes = max_bits / 8;
}

void set_max_delta(Layout& l, Requirements& rules, std::uint32_t max_delta) {
  rules.require(max_delta >= 1 && max_delta < l.counter_max, "max_delta_counter",
                "at least 1 and below the largest counter");
  l.max_delta_counter = max_delta;
}

void set_early_sequence(Layout& l, Requirements& rules, const EarlySequence& sequence) {
  rules.require(sequence.max_delta_counter_init <= 14, "max_delta_counter_init", "0 to 14");
  rules.require(sequence.max_no_new_or_repeated_data <= l.counter_max, "max_no_new_or_repeated_data",
                "at most the largest counter");
  rules.require(sequence.sync_counter_init <= l.counter_max, "sync_counter_init",
                "at most the largest counter");
  l.early = sequence;
}

/// The common part of profiles 1 and 11.
template <typename Profile>
Layout short_header(const Profile& profile, Requirements& rules) {
  Layout l;
  l.crc_kind = Layout::Crc::j1850;
  l.crc = {profile.crc_offset_bits, 8};
  l.counter = {profile.counter_offset_bits, 4};
  l.counter_max = 14;
  l.id = profile.data_id;
  require_offset(rules, profile.crc_offset_bits, "crc_offset_bits");
  rules.require(profile.counter_offset_bits % 4 == 0 && profile.counter_offset_bits <= offset_limit,
                "counter_offset_bits", "a multiple of 4, at most 0xffffff");
  rules.require(profile.counter_offset_bits / 8 != profile.crc_offset_bits / 8, "counter_offset_bits",
                "outside the byte of the CRC");
  switch (profile.data_id_mode) {
    case DataIdMode::both:
      l.implicit_id = Layout::ImplicitId::before_both;
      break;
    case DataIdMode::alternating:
      l.implicit_id = Layout::ImplicitId::before_alternating;
      break;
    case DataIdMode::low:
      l.implicit_id = Layout::ImplicitId::before_low;
      break;
    case DataIdMode::nibble: {
      l.implicit_id = Layout::ImplicitId::before_low_and_zero;
      const std::uint32_t at = profile.data_id_nibble_offset_bits;
      l.data_id_nibble = {at, 4};
      rules.require(at % 4 == 0 && at <= offset_limit, "data_id_nibble_offset_bits",
                    "a multiple of 4, at most 0xffffff");
      rules.require(at / 8 != l.crc.at / 8 && at != l.counter.at, "data_id_nibble_offset_bits",
                    "outside the byte of the CRC and beside the counter");
      break;
    }
    default:
      rules.require(false, "data_id_mode", "one of the named modes");
  }
  set_fixed_length(l, rules, profile.data_bits, 240);
  return l;
}

/// The common part of profiles 2 and 22.
template <typename Profile>
Layout listed_ids(const Profile& profile, Requirements& rules) {
  Layout l;
  l.crc_kind = Layout::Crc::h2f;
  l.crc = {profile.offset_bits, 8};
  l.counter = {profile.offset_bits + 8, 4};
  l.counter_max = 15;
  l.first_counter = 1;  // these profiles increment the counter before they send
  l.implicit_id = Layout::ImplicitId::behind_by_counter;
  l.id_list = profile.data_id_list;
  require_offset(rules, profile.offset_bits, "offset_bits");
  set_fixed_length(l, rules, profile.data_bits, 4096 * 8);
  return l;
}

/// Profiles 4, 44 and their m variants.
Layout length_first(const Profile4& profile, Requirements& rules, bool method) {
  Layout l;
  const std::uint32_t at = profile.offset_bits;
  l.crc_kind = Layout::Crc::p4;
  l.length = {at, 16};
  l.counter = {at + 16, 16};
  l.data_id = {at + 32, 32};
  l.crc = {at + 64, 32};
  l.source = {at + 96, method ? 32U : 0U};
  l.counter_max = 0xffff;
  l.id = profile.data_id;
  require_offset(rules, at, "offset_bits");
  set_length_range(l, rules, profile.min_data_bits, profile.max_data_bits, 0xffff * 8);
  set_max_delta(l, rules, profile.max_delta_counter);
  return l;
}

/// Profiles 7, 7m, 8 and 8m: the CRC, then 32 bits each of length, counter and Data ID.
Layout crc_first(const Profile7& profile, Requirements& rules, Layout::Crc kind, bool method) {
  Layout l;
  const std::uint32_t at = profile.offset_bits;
  l.crc_kind = kind;
  l.crc = {at, kind == Layout::Crc::ecma ? 64U : 32U};
  l.length = {l.crc.end(), 32};
  l.counter = {l.length.end(), 32};
  l.data_id = {l.counter.end(), 32};
  l.source = {l.data_id.end(), method ? 32U : 0U};
  l.counter_max = 0xffffffff;
  l.id = profile.data_id;
  require_offset(rules, at, "offset_bits");
  set_length_range(l, rules, profile.min_data_bits, profile.max_data_bits, 0xfffffff8);
  set_max_delta(l, rules, profile.max_delta_counter);
  return l;
}

/// One overload a profile, for std::visit.
struct ToLayout {
  Requirements& rules;

  Layout operator()(const Profile1& profile) const {
    Layout l = short_header(profile, rules);
    set_early_sequence(l, rules, profile.sequence);
    return l;
  }
  Layout operator()(const Profile11& profile) const {
    rules.require(profile.data_id_mode == DataIdMode::both || profile.data_id_mode == DataIdMode::nibble,
                  "data_id_mode", "both or nibble");
    Layout l = short_header(profile, rules);
    set_max_delta(l, rules, profile.max_delta_counter);
    return l;
  }
  Layout operator()(const Profile2& profile) const {
    Layout l = listed_ids(profile, rules);
    set_early_sequence(l, rules, profile.sequence);
    return l;
  }
  Layout operator()(const Profile22& profile) const {
    Layout l = listed_ids(profile, rules);
    set_max_delta(l, rules, profile.max_delta_counter);
    return l;
  }
  Layout operator()(const Profile4& profile) const { return length_first(profile, rules, false); }
  Layout operator()(const Profile44& profile) const { return length_first(profile, rules, false); }
  Layout operator()(const Profile4m& profile) const { return length_first(profile, rules, true); }
  Layout operator()(const Profile44m& profile) const { return length_first(profile, rules, true); }
  Layout operator()(const Profile5& profile) const {
    Layout l;
    l.crc_kind = Layout::Crc::ccitt;
    l.crc_order = profile.crc_order;
    l.crc = {profile.offset_bits, 16};
    l.counter = {profile.offset_bits + 16, 8};
    l.counter_max = 0xff;
    l.id = profile.data_id;
    l.implicit_id = Layout::ImplicitId::behind_little;
    require_offset(rules, profile.offset_bits, "offset_bits");
    set_fixed_length(l, rules, profile.data_bits, 4096 * 8);
    set_max_delta(l, rules, profile.max_delta_counter);
    return l;
  }
  Layout operator()(const Profile6& profile) const {
    Layout l;
    l.crc_kind = Layout::Crc::ccitt;
    l.crc = {profile.offset_bits, 16};
    l.length = {profile.offset_bits + 16, 16};
    l.counter = {profile.offset_bits + 32, 8};
    l.counter_max = 0xff;
    l.id = profile.data_id;
    l.implicit_id = Layout::ImplicitId::behind_big;
    require_offset(rules, profile.offset_bits, "offset_bits");
    set_length_range(l, rules, profile.min_data_bits, profile.max_data_bits, 0xffff * 8);
    set_max_delta(l, rules, profile.max_delta_counter);
    return l;
  }
  Layout operator()(const Profile7& profile) const {
    return crc_first(profile, rules, Layout::Crc::ecma, false);
  }
  Layout operator()(const Profile7m& profile) const {
    return crc_first(profile, rules, Layout::Crc::ecma, true);
  }
  Layout operator()(const Profile8& profile) const {
    return crc_first(profile, rules, Layout::Crc::p4, false);
  }
  Layout operator()(const Profile8m& profile) const {
    return crc_first(profile, rules, Layout::Crc::p4, true);
  }
};

/// The implicit Data ID: `size` of `bytes`.
struct IdBytes {
  std::array<std::byte, 2> bytes{};
  std::size_t size = 0;
  bool behind = false;
  [[nodiscard]] ByteView view() const noexcept { return ByteView{bytes}.first(size); }
};

IdBytes id_bytes(const Layout& layout, std::uint32_t counter) noexcept {
  const std::byte low{static_cast<std::uint8_t>(layout.id & 0xffU)};
  const std::byte high{static_cast<std::uint8_t>((layout.id >> 8U) & 0xffU)};
  switch (layout.implicit_id) {
    case Layout::ImplicitId::none:
      break;
    case Layout::ImplicitId::before_both:
      return {{low, high}, 2, false};
    case Layout::ImplicitId::before_alternating:
      return {{counter % 2 == 0 ? low : high}, 1, false};
    case Layout::ImplicitId::before_low:
      return {{low}, 1, false};
    case Layout::ImplicitId::before_low_and_zero:
      return {{low}, 2, false};
    case Layout::ImplicitId::behind_by_counter:
      return {{std::byte{layout.id_list[counter % layout.id_list.size()]}}, 1, true};
    case Layout::ImplicitId::behind_little:
      return {{low, high}, 2, true};
    case Layout::ImplicitId::behind_big:
      return {{high, low}, 2, true};
  }
  return {};
}

/// Sums up the pieces in their order; `crc(bytes, previous)` is one of crc.hpp.
template <typename T>
T sum_up(T (*crc)(ByteView, T) noexcept, T sum, const Layout& layout, ByteView front, ByteView data,
         std::uint32_t counter) noexcept {
  const IdBytes id = id_bytes(layout, counter);
  const std::size_t crc_at = layout.crc.at / 8 - front.size();
  if (!id.behind) {
    sum = crc(id.view(), sum);
  }
  sum = crc(front, sum);
  sum = crc(data.first(crc_at), sum);
  sum = crc(data.subspan(crc_at + sizeof(T)), sum);
  return id.behind ? crc(id.view(), sum) : sum;
}

}  // namespace

std::uint32_t Layout::header_at() const noexcept {
  std::uint32_t first = std::min(crc.at, counter.at);
  for (const HeaderField& field : {length, data_id, data_id_nibble, source}) {
    first = field.size == 0 ? first : std::min(first, field.at);
  }
  return first / 8;
}

std::optional<std::uint32_t> Layout::header_bytes() const noexcept {
  const std::uint32_t bytes = (fields_end(*this) + 7) / 8 - header_at();
  std::uint32_t covered = 0;
  for (const HeaderField& field : {crc, counter, length, data_id, source}) {
    covered += (field.size + 7) / 8;
  }
  // The Data ID nibble may share the byte of the counter.
  covered += data_id_nibble.size != 0 && data_id_nibble.at / 8 != counter.at / 8 ? 1 : 0;
  return covered == bytes ? std::optional{bytes} : std::nullopt;
}

tl::expected<Layout, ConfigError> make_layout(const Config& config) noexcept {
  Requirements rules;
  const Layout layout = std::visit(ToLayout{rules}, config);
  if (rules.broken()) {
    return tl::unexpected{*rules.broken()};
  }
  return layout;
}

std::uint64_t checksum(const Layout& layout, ByteView front, ByteView data, std::uint32_t counter) noexcept {
  switch (layout.crc_kind) {
    case Layout::Crc::j1850:
      // Profiles 1 and 11 start the register at 0 and take away the final XOR.
      return sum_up<std::uint8_t>(crc8, 0xff, layout, front, data, counter) ^ 0xffU;
    case Layout::Crc::h2f:
      return sum_up<std::uint8_t>(crc8_h2f, 0, layout, front, data, counter);
    case Layout::Crc::ccitt:
      return sum_up<std::uint16_t>(crc16, 0xffff, layout, front, data, counter);
    case Layout::Crc::p4:
      return sum_up<std::uint32_t>(crc32_p4, 0, layout, front, data, counter);
    case Layout::Crc::ecma:
      return sum_up<std::uint64_t>(crc64, 0, layout, front, data, counter);
  }
  return 0;
}

std::uint64_t read_field(HeaderField field, ByteView data, std::size_t front_bytes,
                         std::endian order) noexcept {
  const std::byte* at = data.data() + (field.at / 8 - front_bytes);
  switch (field.size) {
    case 4:
      return (std::to_integer<unsigned>(*at) >> (field.at % 8)) & 0x0fU;
    case 8:
      return load<std::uint8_t>(at, order);
    case 16:
      return load<std::uint16_t>(at, order);
    case 32:
      return load<std::uint32_t>(at, order);
    case 64:
      return load<std::uint64_t>(at, order);
    default:
      return 0;
  }
}

void write_field(HeaderField field, ByteSpan data, std::size_t front_bytes, std::uint64_t value,
                 std::endian order) noexcept {
  if (field.size == 0) {
    return;
  }
  std::byte* at = data.data() + (field.at / 8 - front_bytes);
  switch (field.size) {
    case 4: {
      const unsigned shift = field.at % 8;
      *at = (*at & ~(std::byte{0x0f} << shift)) | (static_cast<std::byte>(value & 0x0fU) << shift);
      break;
    }
    case 8:
      store(at, static_cast<std::uint8_t>(value), order);
      break;
    case 16:
      store(at, static_cast<std::uint16_t>(value), order);
      break;
    case 32:
      store(at, static_cast<std::uint32_t>(value), order);
      break;
    default:
      store(at, value, order);
      break;
  }
}

}  // namespace trestle::someip::e2e
