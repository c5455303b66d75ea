#include "sd/wire/entry.hpp"

#include "someip/wire/enumerator_name.hpp"

namespace trestle::sd {
using someip::ByteReader;
using someip::ByteWriter;

const char* to_string(EntryKind kind) noexcept {
  static constexpr std::array names{"find_service",
                                    "offer_service",
                                    "stop_offer_service",
                                    "subscribe_eventgroup",
                                    "stop_subscribe_eventgroup",
                                    "subscribe_eventgroup_ack",
                                    "subscribe_eventgroup_nack",
                                    "unknown"};
  return someip::enumerator_name<EntryKind::unknown>(names, kind);
}

EntryKind Entry::kind() const noexcept {
  switch (type) {
    case EntryType::find_service:
      return EntryKind::find_service;
    case EntryType::offer_service:  // [feat_req_someipsd_262]
      return ttl_s == 0 ? EntryKind::stop_offer_service : EntryKind::offer_service;
    case EntryType::subscribe_eventgroup:  // [feat_req_someipsd_333]
      return ttl_s == 0 ? EntryKind::stop_subscribe_eventgroup : EntryKind::subscribe_eventgroup;
    case EntryType::subscribe_eventgroup_ack:  // [feat_req_someipsd_619]
      return ttl_s == 0 ? EntryKind::subscribe_eventgroup_nack : EntryKind::subscribe_eventgroup_ack;
  }
  return EntryKind::unknown;
}

Entry decode_entry(std::span<const std::byte, entry_bytes> bytes) noexcept {
  ByteReader in{bytes};
  Entry entry;
  entry.type = EntryType{in.u8()};
  entry.first_run.index = in.u8();
  entry.second_run.index = in.u8();
  const std::uint8_t counts = in.u8();
  entry.first_run.count = static_cast<std::uint8_t>(counts >> 4U);
  entry.second_run.count = static_cast<std::uint8_t>(counts & 0x0fU);
  entry.service = ServiceId{in.u16()};
  entry.instance = InstanceId{in.u16()};
  const std::uint32_t major_and_ttl = in.u32();
  entry.major = static_cast<std::uint8_t>(major_and_ttl >> 24U);
  entry.ttl_s = major_and_ttl & infinite_ttl_s;
  entry.tail = in.u32();
  return entry;
}

void encode(const Entry& entry, std::span<std::byte, entry_bytes> room) noexcept {
  ByteWriter out{room};
  out.u8(static_cast<std::uint8_t>(entry.type));
  out.u8(entry.first_run.index);
  out.u8(entry.second_run.index);
  out.u8(
      static_cast<std::uint8_t>((unsigned{entry.first_run.count} << 4U) | (entry.second_run.count & 0x0fU)));
  out.u16(value(entry.service));
  out.u16(value(entry.instance));
  out.u32((std::uint32_t{entry.major} << 24U) | (entry.ttl_s & infinite_ttl_s));
  out.u32(entry.tail);
}

}  // namespace trestle::sd
