#include "dds_adapter/participant.hpp"

#include "dds_adapter/participant_core.hpp"

namespace trestle::dds {

const char* to_string(Happening::Kind kind) noexcept {
  switch (kind) {
    case Happening::Kind::peer_found:
      return "peer_found";
    case Happening::Kind::peer_lost:
      return "peer_lost";
    case Happening::Kind::matched:
      return "matched";
    case Happening::Kind::unmatched:
      return "unmatched";
    case Happening::Kind::incompatible_qos:
      return "incompatible_qos";
    case Happening::Kind::incompatible_type:
      return "incompatible_type";
    case Happening::Kind::other_type_hash:
      return "other_type_hash";
    case Happening::Kind::deadline_missed:
      return "deadline_missed";
    case Happening::Kind::liveliness_lost:
      return "liveliness_lost";
    case Happening::Kind::small_send_buffer:
      return "small_send_buffer";
  }
  return "?";
}

Participant::Participant(const ParticipantConfig& config)
    : core_{std::make_shared<detail::ParticipantCore>(config)} {}
Participant::Participant(Participant&&) noexcept = default;

Participant& Participant::operator=(Participant&& other) noexcept {
  if (this != &other) {
    if (core_) {
      core_->silence();
    }
    core_ = std::move(other.core_);
  }
  return *this;
}

Participant::~Participant() {
  if (core_) {
    core_->silence();
  }
}

int Participant::incoming() const noexcept {
  return core_->sockets() != nullptr ? core_->sockets()->incoming() : -1;
}
void Participant::receive() {
  if (core_->sockets() != nullptr) {
    core_->sockets()->receive();
  }
}
std::string Participant::guid() const {
  return core_->guid();
}
std::vector<FoundWriter> Participant::writers() const {
  return core_->writers();
}
std::vector<Counterpart> Participant::counterparts(std::string_view topic, bool writers) const {
  return core_->counterparts(topic, writers);
}
std::vector<BridgeEnd> Participant::bridge_ends(std::string_view topic) const {
  return core_->bridge_ends().of_topic(topic);
}
std::uint64_t Participant::bridge_changes() const noexcept {
  return core_->bridge_ends().changes();
}
std::size_t Participant::peers() const {
  return core_->peers();
}
std::uint64_t Participant::not_remembered() const {
  return core_->not_remembered();
}
bool Participant::shares_memory() const {
  return core_->shares_memory();
}
std::vector<std::string> Participant::buffers_not_granted() const {
  return core_->buffers_not_granted();
}
Vendor Participant::vendor(const Guid& endpoint) const {
  return core_->vendor(detail::to_fast(endpoint).guidPrefix);
}

}  // namespace trestle::dds
