// Property: a configuration is refused or usable; what protect() makes is accepted by the checker, only once,
// and not with a bit flipped; a checker takes any bytes, and what it accepts is what protect() would have
// made.
#include <algorithm>
#include <cstdlib>
#include <vector>

#include "someip/core/e2e/checker.hpp"
#include "someip/core/e2e/protector.hpp"
#include "someip/wire/bytes.hpp"

using namespace trestle;
using namespace trestle::someip;
using namespace trestle::someip::e2e;

namespace {

EarlySequence read_sequence(ByteReader& in) {
  return {.max_delta_counter_init = in.u8(),
          .max_no_new_or_repeated_data = in.u8(),
          .sync_counter_init = in.u8(),
          .behavior = (in.u8() & 1U) != 0 ? Behavior::r4_2 : Behavior::pre_r4_2};
}

/// Profiles 1 and 11 alike.
template <typename Profile>
Profile read_short(ByteReader& in) {
  Profile profile;
  profile.data_id = in.u16();
  profile.data_id_mode = static_cast<DataIdMode>(in.u8());
  profile.data_bits = in.u16();
  profile.crc_offset_bits = in.u16();
  profile.counter_offset_bits = in.u16();
  profile.data_id_nibble_offset_bits = in.u16();
  return profile;
}

/// Profiles 2 and 22 alike.
template <typename Profile>
Profile read_listed(ByteReader& in) {
  Profile profile;
  std::ranges::generate(profile.data_id_list, [&] { return in.u8(); });
  profile.data_bits = in.u16();
  profile.offset_bits = in.u16();
  return profile;
}

/// Profiles with a length field.
template <typename Profile>
Profile read_ranged(ByteReader& in) {
  Profile profile;
  profile.data_id = static_cast<decltype(profile.data_id)>(in.u32());
  profile.offset_bits = in.u16();
  profile.min_data_bits = in.u16();
  profile.max_data_bits = in.u32();
  profile.max_delta_counter = in.u32();
  return profile;
}

Config read_config(ByteReader& in) {
  switch (in.u8() % std::variant_size_v<Config>) {
    case 0: {
      auto profile = read_short<Profile1>(in);
      profile.sequence = read_sequence(in);
      return profile;
    }
    case 1: {
      auto profile = read_listed<Profile2>(in);
      profile.sequence = read_sequence(in);
      return profile;
    }
    case 2:
      return read_ranged<Profile4>(in);
    case 3:
      return read_ranged<Profile4m>(in);
    case 4:
      return Profile5{.data_id = in.u16(),
                      .data_bits = in.u16(),
                      .offset_bits = in.u16(),
                      .max_delta_counter = in.u16(),
                      .crc_order = (in.u8() & 1U) != 0 ? std::endian::big : std::endian::little};
    case 5:
      return read_ranged<Profile6>(in);
    case 6:
      return read_ranged<Profile7>(in);
    case 7:
      return read_ranged<Profile7m>(in);
    case 8:
      return read_ranged<Profile8>(in);
    case 9: {
      auto profile = read_short<Profile11>(in);
      profile.max_delta_counter = in.u8();
      return profile;
    }
    case 10: {
      auto profile = read_listed<Profile22>(in);
      profile.max_delta_counter = in.u8();
      return profile;
    }
    case 11:
      return read_ranged<Profile44>(in);
    case 12:
      return read_ranged<Profile44m>(in);
    default:
      return read_ranged<Profile8m>(in);
  }
}

void require(bool holds) {
  if (!holds) {
    std::abort();
  }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* input, std::size_t size) {
  ByteReader in{std::as_bytes(std::span{input, size})};
  const Config config = read_config(in);
  const StateMachineConfig machine{.window_size_init = in.u8(),
                                   .window_size_valid = in.u8(),
                                   .window_size_invalid = in.u8(),
                                   .min_ok_init = in.u8(),
                                   .min_ok_valid = in.u8(),
                                   .min_ok_invalid = in.u8(),
                                   .max_error_init = in.u8(),
                                   .max_error_valid = in.u8(),
                                   .max_error_invalid = in.u8(),
                                   .clear_to_invalid = (in.u8() & 1U) != 0,
                                   .transit_to_invalid_extended = (in.u8() & 1U) != 0};
  const MethodInfo method{
      .response = (in.u8() & 1U) != 0, .error = (in.u8() & 1U) != 0, .source_id = in.u32()};
  const std::uint32_t counter = in.u32();
  const std::size_t cut = in.u8();
  const std::uint32_t flipped = in.u32();
  if (in.failed()) {
    return 0;
  }
  const ByteView bytes = in.rest();
  auto protector = Protector::create(config);
  auto checker = Checker::create(config, machine);
  if (!checker) {
    checker = Checker::create(config);
  }
  require(protector.has_value() == checker.has_value());
  if (!protector) {
    return 0;
  }
  const MethodExpectation expected{
      .response = method.response, .error = method.error, .source_id = method.source_id};

  const ByteView front = bytes.first(std::min(cut, bytes.size()));
  std::vector<std::byte> data(bytes.begin() + static_cast<std::ptrdiff_t>(front.size()), bytes.end());
  const CheckResult raw = checker->check(front, data, expected);
  checker->reset();

  protector->resume(raw.fault == Fault::none ? raw.counter : counter);
  const std::uint32_t sent = protector->next_counter();
  const auto before = data;
  if (!protector->protect(front, data, method)) {
    require(data == before && protector->next_counter() == sent && raw.fault != Fault::none);
    checker->no_new_data();
    return 0;
  }
  require(raw.fault != Fault::none || data == before);
  const CheckResult good = checker->check(front, data, expected);
  require(good.fault == Fault::none && good.counter == sent);
  require(checker->check(front, data, expected).status == CheckStatus::repeated);
  const std::size_t bit = flipped % (data.size() * 8);
  const Layout layout = *make_layout(config);
  if (layout.implicit_id == Layout::ImplicitId::behind_by_counter ||
      layout.implicit_id == Layout::ImplicitId::before_alternating) {
    // Another counter means another Data ID in the CRC, which may make up for it if the ids are badly chosen.
    const std::size_t counter_at = layout.counter.at - front.size() * 8;
    if (bit >= counter_at && bit < counter_at + 4) {
      return 0;
    }
  }
  data[bit / 8] ^= std::byte{1} << (bit % 8);
  require(checker->check(front, data, expected).status == CheckStatus::error);
  return 0;
}
