#pragma once
#include "bridge/inspect/decode/message_decoder.hpp"
#include "bridge/traffic/capture_reader.hpp"

namespace trestle::inspect {

/// Prints the SOME/IP messages of recorded traffic.
class CaptureDecoder : public traffic::CaptureReader {
 public:
  struct Options {
    bool reassemble = false;
    std::vector<std::uint16_t> ports;                  ///< carry SOME/IP whatever it looks like
    const describe::Interfaces* interfaces = nullptr;  ///< as MessageDecoder's
  };

  CaptureDecoder(const Options& options, std::function<void(const Json&)> print)
      : traffic::CaptureReader{options.ports, messages_},
        messages_{options.reassemble,
                  {std::move(print),
                   [this](Transport transport, const Endpoint& endpoint) { learn(transport, endpoint); }},
                  options.interfaces} {}

  [[nodiscard]] const MessageDecoder& messages() const noexcept { return messages_; }

 private:
  MessageDecoder messages_;
};

}  // namespace trestle::inspect
