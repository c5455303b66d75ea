#pragma once
#include <chrono>
#include <cstdint>
#include <deque>
#include <vector>

#include "bridge/traffic/message_sink.hpp"

namespace trestle::conform {

/// Finds messages that a capture holds twice, as a mirror port or `-i any` makes it: the same bytes, over
/// UDP, from the same sender to the same receiver, in another frame right after the first one.
class Copies {
 public:
  /// So much later a copy may come. A mirror port takes less than a millisecond.
  static constexpr std::chrono::milliseconds within{3};

  [[nodiscard]] bool is_copy(const traffic::Place& place, const someip::Message& message);

 private:
  struct Recent {
    pcaps::Timestamp time;
    std::uint64_t frame;
    traffic::Flow flow;
    someip::Header header;
    std::vector<std::byte> payload;
  };
  /// Of a flood, the last ones.
  static constexpr std::size_t most_recent = 256;

  std::deque<Recent> recent_;
};

/// Whether a capture holds most messages of service discovery twice. One alone that comes twice may have been
/// sent twice, which is for a rule to say.
class CopyCount : public traffic::MessageSink {
 public:
  bool message(const traffic::Place& place, std::size_t offset, const someip::Message& message) override;
  using MessageSink::undecodable;
  void undecodable(const traffic::Place& place, std::size_t offset, ByteView bytes,
                   const traffic::Violation& violation) override;
  void broken_frame(const traffic::Place& place, const traffic::Violation& violation) override;

  [[nodiscard]] bool most_twice() const noexcept { return copies_ >= 3 && copies_ * 5 >= messages_ * 2; }

 private:
  Copies seen_;
  std::uint64_t messages_ = 0;
  std::uint64_t copies_ = 0;
};

}  // namespace trestle::conform
