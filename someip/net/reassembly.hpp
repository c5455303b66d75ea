#pragma once
#include <cstddef>
#include <limits>
#include <memory>
#include <vector>

#include "someip/core/tp_reassembler.hpp"

namespace trestle::someip {

class Reassembly;

/// The memory that the reassemblies of one owner may use together. A chunk of a place counts from when a
/// segment comes to lie in it until it is given back to the system. Where it does not suffice, first what is
/// only kept for messages to come is given back, then the message gives way that comes slowest.
class ReassemblyBudget {
 public:
  explicit ReassemblyBudget(std::size_t max_bytes) noexcept : max_bytes_{max_bytes} {}

  [[nodiscard]] std::size_t used_bytes() const noexcept { return used_bytes_; }

 private:
  friend class Reassembly;
  /// @param slot  of `asks`, that needs the room and keeps what it has; under way or just complete.
  void make_room(Reassembly& asks, std::size_t slot, TimePoint now);
  [[nodiscard]] bool give_back_oldest(const Reassembly& asks, std::size_t slot);

  std::size_t max_bytes_;
  std::size_t used_bytes_ = 0;
  std::vector<Reassembly*> users_;
};

/// A TpReassembler with memory from the system: a place for each message that is under way or remembered,
/// whose pages are taken as segments fill them, and given back when it is forgotten or others need them. So
/// generous limits cost nothing until they are needed, nor after that. Messages of one kind have one place
/// as long as they come within max_age of each other.
class Reassembly {
 public:
  /// @param budget  that it shares with others; nothing: as much as its messages need.
  Reassembly(std::size_t max_messages, const TpReassemblyLimits& limits,
             std::shared_ptr<ReassemblyBudget> budget = nullptr);
  ~Reassembly();
  Reassembly(const Reassembly&) = delete;
  Reassembly& operator=(const Reassembly&) = delete;

  /// As TpReassembler::on_segment(). What the system has no memory for is dropped as TpDrop::no_slot.
  /// @param max_bytes  of this message, where it is known to be smaller than others.
  [[nodiscard]] Result<std::optional<Reassembled>, TpDrop> on_segment(
      const Endpoint& from, const Message& segment, TimePoint now,
      std::size_t max_bytes = std::numeric_limits<std::size_t>::max()) {
    const Part part = part_of(segment);
    if (part.end > max_bytes) {
      return machine_.refuse(TpDrop::too_large);
    }
    if (slots_.size() < max_messages_ && (slots_.empty() || machine_.used(slots_.size() - 1))) {
      add_place();
    }
    auto outcome = machine_.on_segment(from, segment, now);
    if (outcome) {
      places_[machine_.recent()].sender = from.address;
    }
    if (outcome && (chunks_of(part) & ~places_[machine_.recent()].chunks) != 0) {
      return count_chunks(*outcome, chunks_of(part), now);
    }
    return outcome;
  }
  /// Forgets all messages of a host that was started anew: its Session IDs begin anew, so that what it sends
  /// would be taken for more of the messages before.
  void forget(const IpAddress& sender, TimePoint now);
  void on_time(TimePoint now);
  /// When on_time() has something to do: later only if segments come.
  [[nodiscard]] std::optional<TimePoint> deadline() const;

  [[nodiscard]] const TpCounters& counters() const noexcept { return machine_.counters(); }
  /// Places that there are now.
  [[nodiscard]] std::size_t places() const noexcept { return slots_.size(); }

 private:
  friend class ReassemblyBudget;
  struct Place {
    void* memory;              ///< the map, then the buffer
    std::uint64_t chunks = 0;  ///< a bit for each that counts as used
    IpAddress sender{};        ///< of the last message
  };
  /// What a segment brings of its message.
  struct Part {
    std::size_t begin;
    std::size_t end;
  };
  // Small messages are to count for little, and all bits are to be in one word.
  static constexpr std::size_t small_chunks = 32;
  static constexpr unsigned small_shift = 16;
  static constexpr std::size_t small_bytes = small_chunks << small_shift;

  static Part part_of(const Message& segment) noexcept {
    if (segment.payload.size() < tp_header_bytes) {
      return {0, 0};
    }
    std::uint32_t word = 0;
    for (std::size_t i = 0; i < tp_header_bytes; ++i) {
      word = word << 8U | std::to_integer<std::uint32_t>(segment.payload[i]);
    }
    const std::size_t begin = to_tp_header(word).offset;
    return {begin, begin + segment.payload.size() - tp_header_bytes};
  }
  [[nodiscard]] std::size_t chunk_of(std::size_t byte) const noexcept {
    return byte < small_bytes ? byte >> small_shift : small_chunks + ((byte - small_bytes) >> large_shift_);
  }
  [[nodiscard]] std::uint64_t chunks_of(const Part& part) const noexcept {
    if (part.begin == part.end) {
      return 0;
    }
    const std::uint64_t last = std::uint64_t{1} << chunk_of(part.end - 1);
    const std::uint64_t first = std::uint64_t{1} << chunk_of(part.begin);
    return last | (last - first) | first;
  }
  /// Counts chunks of the slot that the last segment went to, which may end its message or others.
  Result<std::optional<Reassembled>, TpDrop> count_chunks(const std::optional<Reassembled>& whole,
                                                          std::uint64_t chunks, TimePoint now);
  [[nodiscard]] std::size_t bytes_of(std::uint64_t chunks) const noexcept;
  /// Gives the pages of a place back.
  void empty(Place& place);
  /// As one that has never been used.
  [[nodiscard]] TpSlot slot_of(const Place& place) const noexcept;
  void add_place();
  void remove_place();

  std::size_t max_messages_;
  std::size_t max_message_bytes_;
  std::size_t place_bytes_;  ///< a whole number of pages
  unsigned large_shift_;     ///< the size of chunks behind the small ones
  std::shared_ptr<ReassemblyBudget> budget_;
  std::vector<Place> places_;
  std::vector<TpSlot> slots_;  ///< never grows beyond what is reserved
  TpReassembler machine_;
};

}  // namespace trestle::someip
