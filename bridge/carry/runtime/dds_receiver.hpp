#pragma once
#include <memory>

#include "dds_adapter/participant.hpp"

namespace boost::asio {
class io_context;
}

namespace trestle::carry {

/// Whether the thread of a bridge receives the samples of DDS: only if the system lets enough of them wait
/// while that thread sends others, which takes a millisecond at most. Otherwise a thread of DDS is always
/// free to take them.
[[nodiscard]] bool receives_samples() noexcept;

/// Receives the samples of a polled participant on the thread that runs the io_context, so that a sample does
/// not change threads on its way through the bridge.
class DdsReceiver {
 public:
  /// @param participant  outlives it.
  DdsReceiver(boost::asio::io_context& io, dds::Participant& participant);
  ~DdsReceiver();
  DdsReceiver(const DdsReceiver&) = delete;
  DdsReceiver& operator=(const DdsReceiver&) = delete;

 private:
  struct State;
  std::shared_ptr<State> state_;
};

}  // namespace trestle::carry
