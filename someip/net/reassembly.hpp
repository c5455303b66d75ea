#pragma once
#include <cstddef>
#include <vector>

#include "someip/core/tp_reassembler.hpp"

namespace trestle::someip {

/// A TpReassembler with memory from the system: a place for each message that is under way or remembered,
/// whose pages are taken as segments fill them, and given back when it is forgotten. So generous limits cost
/// nothing until they are needed, nor after that. Messages of one kind have one place as long as they come
/// within max_age of each other.
class Reassembly {
 public:
  Reassembly(std::size_t max_messages, const TpReassemblyLimits& limits);
  ~Reassembly();
  Reassembly(const Reassembly&) = delete;
  Reassembly& operator=(const Reassembly&) = delete;

  /// As TpReassembler::on_segment(). What the system has no memory for is dropped as TpDrop::no_slot.
  [[nodiscard]] Result<std::optional<Reassembled>, TpDrop> on_segment(const Endpoint& from,
                                                                      const Message& segment, TimePoint now) {
    if (slots_.size() < max_messages_ && (slots_.empty() || machine_.used(slots_.size() - 1))) {
      add_place();
    }
    return machine_.on_segment(from, segment, now);
  }
  void on_time(TimePoint now);
  /// When on_time() has something to do: later only if segments come.
  [[nodiscard]] std::optional<TimePoint> deadline() const;

  [[nodiscard]] const TpCounters& counters() const noexcept { return machine_.counters(); }
  /// Places that there are now.
  [[nodiscard]] std::size_t places() const noexcept { return slots_.size(); }

 private:
  void add_place();
  void remove_place();

  std::size_t max_messages_;
  std::size_t max_message_bytes_;
  std::size_t place_bytes_;  ///< a whole number of pages: the map, then the buffer
  std::vector<void*> places_;
  std::vector<TpSlot> slots_;  ///< never grows beyond what is reserved
  TpReassembler machine_;
};

}  // namespace trestle::someip
