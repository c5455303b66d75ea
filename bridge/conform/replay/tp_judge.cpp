#include <fmt/format.h>

#include "bridge/conform/replay/replay.hpp"

/// Segments of SOME/IP-TP.
namespace trestle::conform {
namespace {

/// Messages that are on their way, or were never completed.
constexpr std::size_t most_messages_at_once = 10'000;

}  // namespace

void Replay::judge_tp(const At& at) {
  const someip::Header& header = at.message.header;
  check(Rule::tp_session, at, value(header.session) != 0, "Session ID", "not 0", "0");
  const auto segment = someip::decode_tp(at.message);
  if (!segment) {
    check(Rule::tp_length, at, false, "segment",
          "a TP header, and a multiple of 16 bytes before the last one",
          fmt::format("{} bytes of payload", at.message.payload.size()));
    return;
  }
  const std::size_t size = segment->slice.size();
  check(Rule::tp_length, at, size <= someip::tp_default_segment_bytes, "segment", "1392 bytes at most",
        fmt::format("{} bytes", size));
  check(Rule::tp_reserved, at, segment->header.reserved == 0, "reserved bits", "0",
        std::to_string(segment->header.reserved));
  const std::uint64_t offset = segment->header.offset;
  const SegmentsKey key{at.place.flow, (std::uint32_t{value(header.service)} << 16U) | value(header.method),
                        (std::uint32_t{value(header.client)} << 16U) | value(header.session),
                        static_cast<std::uint8_t>(header.type)};
  auto known = segments_.find(key);
  if (known == segments_.end() || (offset == 0 && known->second.next == 0)) {
    // The capture may begin in the middle of a message; one that is lost before the first is not told apart.
    check(Rule::tp_order, at, offset == 0 || at.place.time == first_, "offset of the first segment", "0",
          std::to_string(offset));
    if (segment->header.more) {
      check(Rule::tp_largest, at, size == someip::tp_default_segment_bytes, "segment", "1392 bytes",
            fmt::format("{} bytes", size));
    }
    if (segments_.size() >= most_messages_at_once) {
      segments_.clear();
    }
    known = segments_
                .insert_or_assign(key, Segments{.next = offset + size,
                                                .size = size,
                                                .interface_version = header.interface_version,
                                                .code = header.return_code})
                .first;
  } else {
    Segments& before = known->second;
    check(Rule::tp_overlap, at, offset >= before.next, "offset", fmt::format("{} or more", before.next),
          std::to_string(offset));
    if (offset >= before.next) {
      check(Rule::tp_order, at, offset == before.next, "offset", std::to_string(before.next),
            std::to_string(offset));
    }
    if (segment->header.more) {
      check(Rule::tp_equal, at, size == before.size, "segment",
            fmt::format("{} bytes, as the first", before.size), fmt::format("{} bytes", size));
    }
    check(Rule::tp_header, at,
          header.interface_version == before.interface_version && header.return_code == before.code,
          "Interface Version and Return Code", "those of the first segment", "others");
    before.next = std::max(before.next, offset + size);
  }
  if (!segment->header.more) {
    segments_.erase(known);  // the Session ID may come again
  }
}

}  // namespace trestle::conform
