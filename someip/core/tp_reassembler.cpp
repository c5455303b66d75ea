#include "someip/core/tp_reassembler.hpp"

#include <algorithm>
#include <bit>
#include <cassert>
#include <cstring>

#include "someip/core/guards.hpp"
#include "someip/wire/enumerator_name.hpp"

namespace trestle::someip {
namespace {

constexpr std::size_t largest_payload_bytes = 0xffffffff - length_covered_header_bytes;

/// Whether all is equal that segments of one message share, but the session.  [feat_req_someiptp_781]
bool same_kind(const Header& a, const Header& b) noexcept {
  return a.method == b.method && a.service == b.service && a.client == b.client && a.type == b.type &&
         a.interface_version == b.interface_version && a.protocol == b.protocol;
}

/// Copies bytes [begin, end) of the message out of the slice that starts at `offset` and holds them.
void copy(ByteSpan buffer, std::uint32_t begin, std::uint32_t end, std::uint32_t offset,
          ByteView slice) noexcept {
  std::memcpy(buffer.data() + begin, slice.data() + (begin - offset), end - begin);
}

// A bit of a map stands for this many bytes, a unit. All segments but the last are a multiple of it long
// [feat_req_someiptp_772], so a unit is there completely or not at all; the last one ends with the message.
constexpr std::uint32_t unit_bytes = 16;
constexpr std::uint32_t word_units = 32;

constexpr std::uint32_t units(std::uint32_t bytes) noexcept {
  return bytes / unit_bytes + (bytes % unit_bytes == 0 ? 0U : 1U);
}

/// Marks units [from, to) as there or missing.
void mark(std::span<std::uint32_t> map, std::uint32_t from, std::uint32_t to, bool there) noexcept {
  constexpr std::uint32_t all = ~std::uint32_t{0};
  while (from < to) {
    const std::uint32_t bit = from % word_units;
    if (bit == 0 && to - from >= word_units) {
      const std::uint32_t words = (to - from) / word_units;
      std::fill_n(map.begin() + from / word_units, words, there ? all : 0U);
      from += words * word_units;
      continue;
    }
    const std::uint32_t count = std::min(word_units - bit, to - from);
    const std::uint32_t mask = (all >> (word_units - count)) << bit;
    std::uint32_t& word = map[from / word_units];
    word = there ? word | mask : word & ~mask;
    from += count;
  }
}

/// The first unit in [from, to) that is there, or missing; `to` if none is.
std::uint32_t first_unit(std::span<const std::uint32_t> map, std::uint32_t from, std::uint32_t to,
                         bool there) noexcept {
  while (from < to) {
    const std::uint32_t word = map[from / word_units];
    const std::uint32_t rest = (there ? word : ~word) >> from % word_units;
    if (rest != 0) {
      return std::min(from + static_cast<std::uint32_t>(std::countr_zero(rest)), to);
    }
    from += word_units - from % word_units;
  }
  return to;
}

constexpr std::uint64_t ages_per_s = 1'000'000'000 / 1024;

// A message has practically stopped when it is slower than this fraction of the protected rate.
constexpr std::uint32_t stopped_share = 64;

}  // namespace

const char* to_string(TpDrop reason) noexcept {
  static constexpr std::array names{
      "malformed", "unaligned",        "session_zero", "too_large", "too_many_from_sender",
      "no_slot",   "inconsistent_end", "overlap",      "stale",     "replaced",
      "aged_out",  "gave_way",         "no_memory"};
  return enumerator_name<TpDrop::no_memory>(names, reason);
}

TpReassembler::TpReassembler(std::span<TpSlot> slots, const TpReassemblyLimits& limits) noexcept
    : slots_{slots}, limits_{limits} {
  limits_.max_message_bytes = std::min(limits.max_message_bytes, largest_payload_bytes);
  for (const TpSlot& slot : slots_) {
    assert(slot.buffer_.size() >= limits.max_message_bytes && "a buffer is smaller than max_message_bytes");
    assert(slot.map_.size() >= tp_map_words(limits.max_message_bytes) && "a map is too small");
    limits_.max_message_bytes = std::min(limits_.max_message_bytes, slot.buffer_.size());
  }
}

TpReassembler::Outcome TpReassembler::on_segment(const Endpoint& from, const Message& message,
                                                 TimePoint now) noexcept {
  ++counters_.segments;
  if (is_due(earliest_, now)) {
    on_time(now);
  }
  TpSlot* slot = find(from, message.header, now);
  const bool same_session = slot != nullptr && slot->header_.session == message.header.session;

  const Result<TpView> segment = decode_tp(message);
  if (!segment || (segment->header.more && segment->slice.empty())) {
    const TpDrop reason =
        !segment && segment.error() == WireError::bad_tp_offset ? TpDrop::unaligned : TpDrop::malformed;
    return same_session && slot->state_ == TpSlot::State::collecting ? give_up(*slot, reason, now)
                                                                     : drop(reason);
  }
  if (message.header.session == SessionId{0}) {
    return drop(TpDrop::session_zero);
  }
  if (same_session) {
    if (slot->state_ == TpSlot::State::finished) {
      return drop(TpDrop::stale);
    }
    return add(*slot, *segment, message.header.return_code, now);
  }
  // Here another message begins. Late segments of the previous one must not replace it: both would be lost.
  if (slot != nullptr && slot->previous_ == message.header.session) {
    return drop(TpDrop::stale);
  }
  // A segment that is too large ends the wait for the old message, but takes no slot from others.
  if (slot == nullptr &&
      segment->header.offset + std::uint64_t{segment->slice.size()} > limits_.max_message_bytes) {
    return drop(TpDrop::too_large);
  }
  const bool at_start = segment->header.offset == 0;
  if (slot != nullptr && slot->state_ == TpSlot::State::collecting) {
    count(TpDrop::replaced);  // the new message takes the old one's place, so their number stays
  } else if (!within_share(from.address, at_start, now)) {
    return drop(TpDrop::too_many_from_sender);
  }
  if (slot == nullptr) {
    slot = vacant();
  }
  if (guards && slot == nullptr) {
    slot = make_way(nullptr, at_start, now);
  }
  if (slot == nullptr) {
    return drop(TpDrop::no_slot);
  }
  begin(*slot, from, message.header, now);
  return add(*slot, *segment, message.header.return_code, now);
}

TpSlot* TpReassembler::find(const Endpoint& from, const Header& header, TimePoint now) noexcept {
  const auto matches = [&](TpSlot& slot) {
    if (slot.state_ == TpSlot::State::unused || !same_kind(slot.header_, header) || slot.from_ != from) {
      return false;
    }
    if (slot.state_ == TpSlot::State::finished && is_due(slot.until_, now)) {
      slot.state_ = TpSlot::State::unused;
      return false;
    }
    return true;
  };
  if (recent_ < slots_.size() && matches(slots_[recent_])) {
    return &slots_[recent_];
  }
  const auto found = std::ranges::find_if(slots_, matches);
  if (found == slots_.end()) {
    return nullptr;
  }
  recent_ = static_cast<std::size_t>(found - slots_.begin());
  return &*found;
}

bool TpReassembler::within_share(const IpAddress& address, bool at_start, TimePoint now) noexcept {
  const auto under_way = std::ranges::count_if(slots_, [&](const TpSlot& slot) {
    return slot.state_ == TpSlot::State::collecting && slot.from_.address == address;
  });
  if (static_cast<std::size_t>(under_way) < limits_.max_per_sender) {
    return true;
  }
  if constexpr (!guards) {
    return false;
  }
  TpSlot* const slowest = make_way(&address, at_start, now);
  if (slowest != nullptr) {
    finish(*slowest, now);  // so that its remaining segments are stale
  }
  return slowest != nullptr;
}

TpSlot* TpReassembler::make_way(const IpAddress* sender, bool at_start, TimePoint now) noexcept {
  TpSlot* slowest = nullptr;
  for (TpSlot& slot : slots_) {
    if (slot.state_ == TpSlot::State::collecting && (sender == nullptr || slot.from_.address == *sender) &&
        (slowest == nullptr || slot.received_ * age(*slowest, now) < slowest->received_ * age(slot, now))) {
      slowest = &slot;
    }
  }
  if (slowest == nullptr) {
    return nullptr;
  }
  const std::uint64_t needed =
      at_start ? limits_.protected_bytes_per_s : limits_.protected_bytes_per_s / stopped_share;
  if (slowest->received_ * ages_per_s >= needed * age(*slowest, now)) {
    return nullptr;
  }
  count(TpDrop::gave_way);
  slowest->state_ = TpSlot::State::unused;
  return slowest;
}

std::uint64_t TpReassembler::age(const TpSlot& slot, TimePoint now) const noexcept {
  const auto began = slot.until_ - limits_.max_age;
  const auto elapsed = now > began ? static_cast<std::uint64_t>((now - began).count()) >> 10U : 0U;
  return std::clamp(elapsed, std::uint64_t{1}, std::uint64_t{1} << 31U);  // so that no product overflows
}

std::uint64_t TpReassembler::rate(std::size_t slot, TimePoint now) const noexcept {
  return slots_[slot].received_ * ages_per_s / age(slots_[slot], now);
}

TpSlot* TpReassembler::vacant() noexcept {
  // Only the session is remembered of finished messages; the one that finished first is forgotten first.
  TpSlot* best = nullptr;
  for (TpSlot& slot : slots_) {
    if (slot.state_ == TpSlot::State::unused) {
      return &slot;
    }
    if (slot.state_ == TpSlot::State::finished && (best == nullptr || !is_due(best->until_, slot.until_))) {
      best = &slot;
    }
  }
  if (best != nullptr) {
    best->state_ = TpSlot::State::unused;
  }
  return best;
}

void TpReassembler::begin(TpSlot& slot, const Endpoint& from, const Header& header, TimePoint now) noexcept {
  slot.previous_ = slot.state_ == TpSlot::State::unused ? SessionId{0} : slot.header_.session;
  slot.from_ = from;
  slot.header_ = header;
  slot.state_ = TpSlot::State::collecting;
  slot.written_ = true;
  slot.end_.reset();
  slot.received_ = 0;
  slot.high_water_ = 0;
  slot.until_ = now + limits_.max_age;
  earliest_ = earlier(earliest_, slot.until_);
  recent_ = static_cast<std::size_t>(&slot - slots_.data());
}

TpReassembler::Outcome TpReassembler::add(TpSlot& slot, const TpView& segment, ReturnCode code,
                                          TimePoint now) noexcept {
  if (const auto reason = contradiction(slot, segment)) {
    return give_up(slot, *reason, now);
  }
  const std::uint32_t begin = segment.header.offset;
  const std::uint32_t end = begin + static_cast<std::uint32_t>(segment.slice.size());
  std::uint32_t fresh_bytes = 0;
  if (begin < slot.high_water_) {
    fresh_bytes = fill_gaps(slot, begin, segment.slice);
  } else if (begin > slot.high_water_) {
    if (!slot.has_gaps()) {
      slot.mapped_from_ = slot.high_water_;
    }
    mark(slot.map_, units(slot.high_water_), units(begin), false);
    slot.high_water_ = begin;
  }
  if (end > slot.high_water_) {  // the usual case: all of the segment, right behind the one before
    copy(slot.buffer_, slot.high_water_, end, begin, segment.slice);
    if (slot.has_gaps()) {
      mark(slot.map_, units(slot.high_water_), units(end), true);
    }
    fresh_bytes += end - slot.high_water_;
    slot.high_water_ = end;
  }
  slot.received_ += fresh_bytes;

  const bool tells_end = !segment.header.more && !slot.end_;
  if (tells_end) {
    slot.end_ = end;
  }
  const bool used = fresh_bytes > 0 || tells_end;
  if (fresh_bytes < segment.slice.size() && used) {
    count(TpDrop::overlap);
  }
  // No byte is beyond the end, so every byte was received.
  // [feat_req_someiptp_783]
  if (slot.end_ == slot.received_) {
    finish(slot, now);
    ++counters_.messages;
    Reassembled whole{slot.header_, ByteView{slot.buffer_.first(slot.high_water_)}, slot.from_,
                      static_cast<std::size_t>(&slot - slots_.data())};
    whole.header.type = without_tp(whole.header.type);  // [feat_req_someiptp_785]
    whole.header.return_code = code;
    return whole;
  }
  if (!used) {
    return drop(TpDrop::overlap);
  }
  return std::nullopt;
}

std::optional<TpDrop> TpReassembler::contradiction(const TpSlot& slot, const TpView& segment) const noexcept {
  const std::uint64_t end = segment.header.offset + std::uint64_t{segment.slice.size()};
  if (end > limits_.max_message_bytes) {
    return TpDrop::too_large;
  }
  const bool last = !segment.header.more;
  const bool beyond_end = slot.end_ && end > *slot.end_;
  const bool other_end = slot.end_ && last && end != *slot.end_;
  const bool end_too_early = last && end < slot.high_water_;
  if (beyond_end || other_end || end_too_early) {
    return TpDrop::inconsistent_end;
  }
  return std::nullopt;
}

std::uint32_t TpReassembler::fill_gaps(TpSlot& slot, std::uint32_t offset, ByteView slice) noexcept {
  std::uint32_t filled = 0;
  if (!slot.has_gaps()) {
    return filled;
  }
  const std::uint32_t end = std::min(offset + static_cast<std::uint32_t>(slice.size()), slot.high_water_);
  const std::uint32_t last = units(end);
  std::uint32_t unit = units(std::max(offset, slot.mapped_from_));
  while ((unit = first_unit(slot.map_, unit, last, false)) < last) {
    const std::uint32_t next = first_unit(slot.map_, unit, last, true);
    const std::uint32_t from = unit * unit_bytes;
    const std::uint32_t to = std::min(next * unit_bytes, end);
    copy(slot.buffer_, from, to, offset, slice);
    mark(slot.map_, unit, next, true);
    filled += to - from;
    unit = next;
  }
  return filled;
}

void TpReassembler::on_time(TimePoint now) noexcept {
  if (!is_due(earliest_, now)) {
    return;
  }
  earliest_ = TimePoint::max();
  for (TpSlot& slot : slots_) {
    if (slot.state_ != TpSlot::State::collecting) {
      continue;
    }
    if (is_due(slot.until_, now)) {
      count(TpDrop::aged_out);
      finish(slot, now);
    } else {
      earliest_ = earlier(earliest_, slot.until_);
    }
  }
}

std::optional<TimePoint> TpReassembler::deadline() const noexcept {
  std::optional<TimePoint> first;
  for (const TpSlot& slot : slots_) {
    if (slot.state_ == TpSlot::State::collecting && (!first || !is_due(*first, slot.until_))) {
      first = slot.until_;
    }
  }
  return first;
}

std::optional<std::size_t> TpReassembler::forget(TimePoint now) noexcept {
  for (TpSlot& slot : slots_) {
    if (slot.state_ == TpSlot::State::finished && is_due(slot.until_, now)) {
      slot.state_ = TpSlot::State::unused;
    }
    if (slot.state_ == TpSlot::State::unused && slot.written_) {
      slot.written_ = false;
      return static_cast<std::size_t>(&slot - slots_.data());
    }
  }
  return std::nullopt;
}

std::optional<TimePoint> TpReassembler::forget_deadline() const noexcept {
  std::optional<TimePoint> first;
  for (const TpSlot& slot : slots_) {
    if (slot.state_ == TpSlot::State::finished && (!first || !is_due(*first, slot.until_))) {
      first = slot.until_;
    }
  }
  return first;
}

std::size_t TpReassembler::size() const noexcept {
  return static_cast<std::size_t>(std::ranges::count(slots_, TpSlot::State::collecting, &TpSlot::state_));
}

void TpReassembler::finish(TpSlot& slot, TimePoint now) const noexcept {
  slot.state_ = TpSlot::State::finished;
  slot.until_ = now + limits_.max_age;
}

TpReassembler::Outcome TpReassembler::give_up(TpSlot& slot, TpDrop reason, TimePoint now) noexcept {
  finish(slot, now);
  return drop(reason);
}

TpReassembler::Outcome TpReassembler::drop(TpDrop reason) noexcept {
  count(reason);
  return tl::unexpected{reason};
}

}  // namespace trestle::someip
