#pragma once
#include <cstdint>
#include <functional>
#include <span>
#include <string>
#include <vector>

/// Faults that the device can be started with, so that it can be seen that a conformance runner finds them.
///
/// They are made where the device meets the system: sendmsg() and recvmsg() of this program (faults.cpp)
/// change what goes out and comes in. So the device itself stays an example of how to use the library.
namespace ets {

using Bytes = std::vector<std::uint8_t>;
using Span = std::span<std::uint8_t>;

/// Where a datagram goes to, or an option says that one may go to.
struct Receiver {
  Bytes address{};  ///< 4 or 16 bytes, as IPv4 or IPv6; empty: not known
  unsigned port = 0;
};

/// A datagram, or what goes at once on a TCP connection, on its way out.
struct Outgoing {
  Bytes bytes;
  bool stream = false;
  unsigned port = 0;       ///< of the device
  bool multicast = false;  ///< it goes to a multicast group
  Receiver to{};           ///< of a datagram
  int copies = 1;          ///< 0: it gets lost
  Bytes besides{};         ///< another datagram, which goes after it
  Receiver besides_to{};
};
/// One that has come, before the device sees it. What is put into `answers` goes back to its sender.
struct Incoming {
  Span bytes;
  bool lost = false;
  std::vector<Bytes> answers{};
};

using Out = std::function<void(Outgoing&)>;
using In = std::function<void(Incoming&)>;

struct Fault {
  const char* name;
  const char* finders;  ///< selectors of `trestle conform`, with commas
  const char* what;
  Out out{};
  In in{};
};

/// All that conformance cases find: sd_faults.cpp, message_faults.cpp.
[[nodiscard]] const std::vector<Fault>& faults();
/// What a fuzzer finds: planted_bugs.cpp.
[[nodiscard]] const std::vector<Fault>& bugs();

/// From now on. False: there is no such fault or bug.
[[nodiscard]] bool choose_fault(const std::string& name);
/// A line for each: its name, a tab, what may find it, a tab, what the device does.
[[nodiscard]] std::string list_of(const std::vector<Fault>& all);

}  // namespace ets
