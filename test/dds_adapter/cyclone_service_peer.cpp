#include "test/dds_adapter/cyclone_service_peer.hpp"

#include <dds/dds.h>

#include <stdexcept>
#include <string>

#include "add.h"

namespace trestle::test {

namespace {

using WireRequest = test_msgs_srv_dds__Add_Request_;
using WireReply = test_msgs_srv_dds__Add_Response_;

dds_entity_t good(dds_entity_t entity) {
  if (entity < 0) {
    throw std::runtime_error{std::string{"Cyclone DDS: "} + dds_strretcode(-entity)};
  }
  return entity;
}

}  // namespace

struct CycloneServicePeer::Entities {
  Role role{};
  dds_entity_t domain = 0;
  dds_entity_t writer = 0;
  dds_entity_t reader = 0;
};

CycloneServicePeer::CycloneServicePeer(std::uint32_t domain, Role role)
    : entities_{std::make_unique<Entities>()} {
  // As in cyclone_peer.cpp.
  constexpr const char* configuration = R"(
    <CycloneDDS><Domain Id="any">
      <General><Interfaces><NetworkInterface name="lo" multicast="true"/></Interfaces></General>
    </Domain></CycloneDDS>)";
  entities_->role = role;
  entities_->domain = good(dds_create_domain(domain, configuration));
  const dds_entity_t participant = good(dds_create_participant(domain, nullptr, nullptr));
  const dds_entity_t requests = good(dds_create_topic(participant, &test_msgs_srv_dds__Add_Request__desc,
                                                      "rq/addRequest", nullptr, nullptr));
  const dds_entity_t replies = good(
      dds_create_topic(participant, &test_msgs_srv_dds__Add_Response__desc, "rr/addReply", nullptr, nullptr));
  dds_qos_t* qos = dds_create_qos();
  dds_qset_reliability(qos, DDS_RELIABILITY_RELIABLE, DDS_SECS(10));
  dds_qset_durability(qos, DDS_DURABILITY_VOLATILE);
  dds_qset_history(qos, DDS_HISTORY_KEEP_LAST, 1000);
  const bool is_client = role == Role::client;
  entities_->writer = good(dds_create_writer(participant, is_client ? requests : replies, qos, nullptr));
  entities_->reader = good(dds_create_reader(participant, is_client ? replies : requests, qos, nullptr));
  dds_delete_qos(qos);
}

CycloneServicePeer::~CycloneServicePeer() {
  dds_delete(entities_->domain);
}

bool CycloneServicePeer::matched() const {
  dds_publication_matched_status_t written{};
  dds_subscription_matched_status_t read{};
  good(dds_get_publication_matched_status(entities_->writer, &written));
  good(dds_get_subscription_matched_status(entities_->reader, &read));
  return written.current_count > 0 && read.current_count > 0;
}

void CycloneServicePeer::send(const CycloneAdd& message) {
  if (entities_->role == Role::client) {
    const WireRequest wire{message.client, message.number, message.a, message.b};
    good(dds_write(entities_->writer, &wire));
  } else {
    const WireReply wire{message.client, message.number, message.a};
    good(dds_write(entities_->writer, &wire));
  }
}

std::optional<CycloneAdd> CycloneServicePeer::take() {
  // A reply to a reader that is not known yet would be lost. rmw_cyclonedds waits for the client's, too.
  if (entities_->role == Role::server && !matched()) {
    return std::nullopt;
  }
  void* sample = nullptr;
  dds_sample_info_t info{};
  if (good(dds_take(entities_->reader, &sample, &info, 1, 1)) == 0) {
    return std::nullopt;
  }
  std::optional<CycloneAdd> result;
  if (info.valid_data && entities_->role == Role::client) {
    const auto& wire = *static_cast<const WireReply*>(sample);
    result = CycloneAdd{wire.client, wire.number, wire.sum, 0};
  } else if (info.valid_data) {
    const auto& wire = *static_cast<const WireRequest*>(sample);
    result = CycloneAdd{wire.client, wire.number, wire.a, wire.b};
  }
  good(dds_return_loan(entities_->reader, &sample, 1));
  return result;
}

}  // namespace trestle::test
