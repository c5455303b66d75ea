#pragma once
#include <algorithm>
#include <optional>
#include <vector>

#include "someip/core/tp_reassembler.hpp"

namespace trestle::test {

/// The rules of TpReassembler said as plainly as possible: each message is a list of bytes that are there or
/// not. Slow, and it allocates as it likes; tests and fuzzing compare the reassembler with it.
class TpModel {
 public:
  TpModel(std::size_t max_messages, const someip::TpReassemblyLimits& limits)
      : slots_(max_messages), limits_{limits} {}

  struct Completed {
    someip::Header header;
    std::vector<std::byte> payload;
    Endpoint from;
  };

  /// The message that the segment completes. `drop` is set when the segment is refused.
  std::optional<Completed> on_segment(const Endpoint& from, const someip::Message& message, TimePoint now,
                                      std::optional<someip::TpDrop>& drop) {
    using someip::TpDrop;
    drop.reset();
    on_time(now);
    Slot* slot = nullptr;
    for (Slot& candidate : slots_) {
      if (candidate.state != State::unused && candidate.from == from &&
          kind(candidate.header) == kind(message.header)) {
        if (candidate.state == State::finished && now >= candidate.until) {
          candidate.state = State::unused;
        } else {
          slot = &candidate;
        }
      }
    }
    const bool ours = slot != nullptr && slot->header.session == message.header.session;
    const auto refuse = [&](TpDrop reason) {
      drop = reason;
      ++drops[static_cast<std::size_t>(reason)];
      return std::nullopt;
    };
    const auto give_up = [&](TpDrop reason) {
      finish(*slot, now);
      return refuse(reason);
    };

    const ByteView bytes = message.payload;
    if (!someip::is_tp(message.header.type) || bytes.size() < 4) {
      return ours && slot->state == State::collecting ? give_up(TpDrop::malformed)
                                                      : refuse(TpDrop::malformed);
    }
    std::uint64_t word = 0;
    for (int i = 0; i < 4; ++i) {
      word = word * 256 + std::to_integer<std::uint64_t>(bytes[static_cast<std::size_t>(i)]);
    }
    const bool more = word % 2 == 1;
    const std::uint64_t begin = word / 16 * 16;
    const ByteView slice = bytes.subspan(4);
    const std::uint64_t end = begin + slice.size();
    if (more && (slice.empty() || slice.size() % 16 != 0)) {
      const TpDrop reason = slice.empty() ? TpDrop::malformed : TpDrop::unaligned;
      return ours && slot->state == State::collecting ? give_up(reason) : refuse(reason);
    }
    if (message.header.session == someip::SessionId{0}) {
      return refuse(TpDrop::session_zero);
    }
    if (ours && slot->state == State::finished) {
      return refuse(TpDrop::stale);
    }
    if (!ours) {
      if (slot != nullptr && slot->previous == message.header.session) {
        return refuse(TpDrop::stale);
      }
      if (slot == nullptr && end > limits_.max_message_bytes) {
        return refuse(TpDrop::too_large);
      }
      const bool replaces = slot != nullptr && slot->state == State::collecting;
      if (!replaces && under_way(from.address) >= limits_.max_per_sender) {
        Slot* const slowest =
            slow_one(begin == 0, now, [&](const Slot& one) { return one.from.address == from.address; });
        if (slowest == nullptr) {
          return refuse(TpDrop::too_many_from_sender);
        }
        ++drops[static_cast<std::size_t>(TpDrop::gave_way)];
        finish(*slowest, now);
      }
      const auto previous = slot != nullptr ? slot->header.session : someip::SessionId{0};
      if (slot == nullptr) {
        slot = vacant();
      }
      if (slot == nullptr) {
        slot = slow_one(begin == 0, now, [](const Slot& /*any*/) { return true; });
        if (slot == nullptr) {
          return refuse(TpDrop::no_slot);
        }
        ++drops[static_cast<std::size_t>(TpDrop::gave_way)];
      }
      if (replaces) {
        ++drops[static_cast<std::size_t>(TpDrop::replaced)];
      }
      *slot =
          Slot{State::collecting, from, message.header, previous, {}, std::nullopt, now + limits_.max_age};
    }

    if (end > limits_.max_message_bytes) {
      return give_up(TpDrop::too_large);
    }
    auto& there = slot->bytes;
    if ((slot->end && (end > *slot->end || (!more && end != *slot->end))) || (!more && end < there.size())) {
      return give_up(TpDrop::inconsistent_end);
    }
    there.resize(std::max(there.size(), static_cast<std::size_t>(end)));
    std::size_t fresh = 0;
    for (std::size_t i = 0; i < slice.size(); ++i) {
      auto& place = there[static_cast<std::size_t>(begin) + i];
      if (!place) {
        place = slice[i];
        ++fresh;
      }
    }
    const bool tells_end = !more && !slot->end;
    if (!more) {
      slot->end = end;
    }
    const bool used = fresh > 0 || tells_end;
    if (used && fresh < slice.size()) {
      ++drops[static_cast<std::size_t>(TpDrop::overlap)];
    }
    if (slot->end == there.size() && std::ranges::all_of(there, &std::optional<std::byte>::has_value)) {
      finish(*slot, now);
      Completed result{message.header, {}, from};
      result.header.type = someip::without_tp(message.header.type);
      for (const auto& byte : there) {
        result.payload.push_back(*byte);
      }
      return result;
    }
    return used ? std::nullopt : refuse(TpDrop::overlap);
  }

  void on_time(TimePoint now) {
    for (Slot& slot : slots_) {
      if (slot.state == State::collecting && now >= slot.until) {
        ++drops[static_cast<std::size_t>(someip::TpDrop::aged_out)];
        finish(slot, now);
      }
    }
  }

  [[nodiscard]] std::size_t size() const {
    return static_cast<std::size_t>(std::ranges::count(slots_, State::collecting, &Slot::state));
  }

  std::array<std::uint64_t, someip::tp_drop_count> drops{};

 private:
  enum class State { unused, collecting, finished };
  struct Slot {
    State state = State::unused;
    Endpoint from;
    someip::Header header;
    someip::SessionId previous{};
    std::vector<std::optional<std::byte>> bytes;
    std::optional<std::uint64_t> end;
    TimePoint until{};
  };

  /// The header with all that may differ between messages of one kind left out.
  static someip::Header kind(someip::Header header) {
    header.session = someip::SessionId{};
    header.return_code = someip::ReturnCode::ok;
    return header;
  }
  /// Bytes per second since the message began.
  [[nodiscard]] double rate(const Slot& slot, TimePoint now) const {
    const auto there = std::ranges::count_if(slot.bytes, &std::optional<std::byte>::has_value);
    const auto age = std::max<Duration::rep>((now - (slot.until - limits_.max_age)).count() / 1024, 1);
    return static_cast<double>(there) * (1'000'000'000 / 1024) / static_cast<double>(age);
  }
  /// The slowest message that gives way to a segment, nothing if all of those that `may` are too fast.
  template <typename May>
  Slot* slow_one(bool at_start, TimePoint now, May may) {
    Slot* slowest = nullptr;
    for (Slot& slot : slots_) {
      if (slot.state == State::collecting && may(slot) &&
          (slowest == nullptr || rate(slot, now) < rate(*slowest, now))) {
        slowest = &slot;
      }
    }
    const std::uint32_t needed = limits_.protected_bytes_per_s / (at_start ? 1 : 64);
    return slowest != nullptr && rate(*slowest, now) < needed ? slowest : nullptr;
  }
  void finish(Slot& slot, TimePoint now) const {
    slot.state = State::finished;
    slot.until = now + limits_.max_age;
  }
  [[nodiscard]] std::size_t under_way(const IpAddress& address) const {
    return static_cast<std::size_t>(std::ranges::count_if(slots_, [&](const Slot& slot) {
      return slot.state == State::collecting && slot.from.address == address;
    }));
  }
  Slot* vacant() {
    const auto unused = std::ranges::find(slots_, State::unused, &Slot::state);
    if (unused != slots_.end()) {
      return &*unused;
    }
    Slot* oldest = nullptr;
    for (Slot& slot : slots_) {
      if (slot.state == State::finished && (oldest == nullptr || slot.until < oldest->until)) {
        oldest = &slot;
      }
    }
    return oldest;
  }

  std::vector<Slot> slots_;
  someip::TpReassemblyLimits limits_;
};

}  // namespace trestle::test
