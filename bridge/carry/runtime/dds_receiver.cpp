#include "bridge/carry/runtime/dds_receiver.hpp"

#include <boost/asio/io_context.hpp>
#include <boost/asio/posix/stream_descriptor.hpp>

namespace trestle::carry {

bool receives_samples() noexcept {
  constexpr std::uint32_t enough = 2U << 20U;  // what 10 Gbit/s and more bring meanwhile
  return dds::polled_buffer_bytes() >= enough;
}

struct DdsReceiver::State : std::enable_shared_from_this<State> {
  State(boost::asio::io_context& io, dds::Participant& of)
      : participant{of}, incoming{io, participant.incoming()} {}
  ~State() { incoming.release(); }  // the descriptor is the participant's

  void wait() {
    incoming.async_wait(boost::asio::posix::stream_descriptor::wait_read,
                        [weak = weak_from_this()](const boost::system::error_code& error) {
                          const auto self = weak.lock();
                          if (error || !self) {
                            return;
                          }
                          try {
                            self->participant.receive();
                          } catch (...) {
                            self->wait();
                            throw;
                          }
                          self->wait();
                        });
  }

  dds::Participant& participant;
  boost::asio::posix::stream_descriptor incoming;
};

DdsReceiver::DdsReceiver(boost::asio::io_context& io, dds::Participant& participant)
    : state_{std::make_shared<State>(io, participant)} {
  state_->wait();
}

DdsReceiver::~DdsReceiver() = default;

}  // namespace trestle::carry
