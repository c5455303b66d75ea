#include "dds_adapter/participant.hpp"

#include <algorithm>

#include "dds_adapter/participant_core.hpp"
#include "someip/wire/enumerator_name.hpp"

namespace trestle::dds {

const char* to_string(Happening::Kind kind) noexcept {
  static constexpr std::array names{
      "peer_found",        "peer_lost",       "matched",         "unmatched",       "incompatible_qos",
      "incompatible_type", "other_type_hash", "deadline_missed", "liveliness_lost", "small_send_buffer"};
  return someip::enumerator_name<Happening::Kind::small_send_buffer>(names, kind, "?");
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
std::vector<FoundParticipant> Participant::participants() const {
  return core_->participants();
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
GuidPrefix participant_of(const Guid& endpoint) noexcept {
  GuidPrefix result{};
  std::copy_n(endpoint.begin(), result.size(), result.begin());
  return result;
}

Vendor Participant::vendor(const Guid& endpoint) const {
  return core_->vendor(detail::to_fast(endpoint).guidPrefix);
}

}  // namespace trestle::dds
