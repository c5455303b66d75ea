#include "someip/core/tp_reassembler.hpp"

#include <algorithm>
#include <cassert>
#include <cstring>
#include <utility>

namespace trestle::someip {
namespace {

constexpr std::size_t largest_payload_bytes = 0xffffffff - length_covered_header_bytes;

/// All that must be equal in the segments of one message, but the session.  [feat_req_someiptp_781]
bool same_kind(const Header& a, const Header& b) noexcept {
  return a.method == b.method && a.service == b.service && a.client == b.client && a.type == b.type &&
         a.interface_version == b.interface_version && a.protocol == b.protocol;
}

/// Copies bytes [begin, end) of the message out of the slice that starts at `offset` and holds them.
void copy(ByteSpan buffer, std::uint32_t begin, std::uint32_t end, std::uint32_t offset,
          ByteView slice) noexcept {
  std::memcpy(buffer.data() + begin, slice.data() + (begin - offset), end - begin);
}

}  // namespace

const char* to_string(TpDrop reason) noexcept {
  switch (reason) {
    case TpDrop::malformed:
      return "malformed";
    case TpDrop::unaligned:
      return "unaligned";
    case TpDrop::session_zero:
      return "session_zero";
    case TpDrop::too_large:
      return "too_large";
    case TpDrop::too_many_from_sender:
      return "too_many_from_sender";
    case TpDrop::no_slot:
      return "no_slot";
    case TpDrop::too_many_gaps:
      return "too_many_gaps";
    case TpDrop::inconsistent_end:
      return "inconsistent_end";
    case TpDrop::overlap:
      return "overlap";
    case TpDrop::stale:
      return "stale";
    case TpDrop::replaced:
      return "replaced";
    case TpDrop::aged_out:
      return "aged_out";
  }
  return "unknown";
}

TpReassembler::TpReassembler(std::span<TpSlot> slots, const TpReassemblyLimits& limits) noexcept
    : slots_{slots}, limits_{limits} {
  limits_.max_message_bytes = std::min(limits.max_message_bytes, largest_payload_bytes);
  for (const TpSlot& slot : slots_) {
    assert(slot.buffer_.size() >= limits.max_message_bytes && "a buffer is smaller than max_message_bytes");
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
  // Here another message begins. Stragglers of the one before must not undo it: that would lose both.
  if (slot != nullptr && slot->previous_ == message.header.session) {
    return drop(TpDrop::stale);
  }
  // What cannot be kept ends the wait for the old message, but takes no slot from others.
  if (slot == nullptr &&
      segment->header.offset + std::uint64_t{segment->slice.size()} > limits_.max_message_bytes) {
    return drop(TpDrop::too_large);
  }
  if (const auto reason = refusal(from, slot)) {
    return drop(*reason);
  }
  if (slot == nullptr) {
    slot = vacant();
    if (slot == nullptr) {
      return drop(TpDrop::no_slot);
    }
  } else if (slot->state_ == TpSlot::State::collecting) {
    count(TpDrop::replaced);
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

std::optional<TpDrop> TpReassembler::refusal(const Endpoint& from, const TpSlot* slot) const noexcept {
  if (slot != nullptr && slot->state_ == TpSlot::State::collecting) {
    return std::nullopt;  // the new message takes the old one's place, so their number stays
  }
  const auto under_way = std::ranges::count_if(slots_, [&](const TpSlot& other) {
    return other.state_ == TpSlot::State::collecting && other.from_.address == from.address;
  });
  if (static_cast<std::size_t>(under_way) >= limits_.max_per_sender) {
    return TpDrop::too_many_from_sender;
  }
  return std::nullopt;
}

TpSlot* TpReassembler::vacant() noexcept {
  // Of finished messages only the session is remembered; the one finished first is the first to be forgotten.
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
  slot.end_.reset();
  slot.high_water_ = 0;
  slot.gap_count_ = 0;
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
    const auto filled = fill_gaps(slot, begin, segment.slice);
    if (!filled) {
      return give_up(slot, TpDrop::too_many_gaps, now);
    }
    fresh_bytes = *filled;
  } else if (begin > slot.high_water_) {
    if (slot.gap_count_ == slot.gaps_.size()) {
      return give_up(slot, TpDrop::too_many_gaps, now);
    }
    slot.gaps_[slot.gap_count_] = TpGap{slot.high_water_, begin};
    ++slot.gap_count_;
    slot.high_water_ = begin;
  }
  if (end > slot.high_water_) {  // the usual case: all of the segment, right behind the one before
    copy(slot.buffer_, slot.high_water_, end, begin, segment.slice);
    fresh_bytes += end - slot.high_water_;
    slot.high_water_ = end;
  }

  const bool tells_end = !segment.header.more && !slot.end_;
  if (tells_end) {
    slot.end_ = end;
  }
  const bool used = fresh_bytes > 0 || tells_end;
  if (fresh_bytes < segment.slice.size() && used) {
    count(TpDrop::overlap);
  }
  // No gap below the furthest byte, and that is the last one: every byte was received.
  // [feat_req_someiptp_783]
  if (slot.gap_count_ == 0 && slot.end_ == slot.high_water_) {
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

std::optional<std::uint32_t> TpReassembler::fill_gaps(TpSlot& slot, std::uint32_t offset,
                                                      ByteView slice) noexcept {
  const std::uint32_t end = offset + static_cast<std::uint32_t>(slice.size());
  std::uint32_t filled = 0;
  std::size_t kept = 0;  // gaps [0, kept) are done; gaps [i, gap_count_) are still to be looked at
  for (std::size_t i = 0; i < slot.gap_count_; ++i) {
    const TpGap gap = slot.gaps_[i];
    const std::uint32_t from = std::max(gap.begin, offset);
    const std::uint32_t to = std::min(gap.end, end);
    if (from >= to) {
      slot.gaps_[kept++] = gap;
      continue;
    }
    const bool left = gap.begin < from;
    const bool right = to < gap.end;
    if (left && right) {  // the segment lies within this gap, so no other was or will be touched
      if (slot.gap_count_ == slot.gaps_.size()) {
        return std::nullopt;
      }
      const auto at = slot.gaps_.begin() + static_cast<std::ptrdiff_t>(i);
      const auto last = slot.gaps_.begin() + static_cast<std::ptrdiff_t>(slot.gap_count_);
      std::move_backward(at + 1, last, last + 1);
      at[0].end = from;
      at[1] = TpGap{to, gap.end};
      ++slot.gap_count_;
      copy(slot.buffer_, from, to, offset, slice);
      return to - from;
    }
    copy(slot.buffer_, from, to, offset, slice);
    filled += to - from;
    if (left || right) {
      slot.gaps_[kept++] = left ? TpGap{gap.begin, from} : TpGap{to, gap.end};
    }
  }
  slot.gap_count_ = kept;
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
