#include "test/dds_adapter/cyclone_peer.hpp"

#include <dds/dds.h>

#include <stdexcept>

#include "blob.h"

namespace trestle::test {

namespace {

using Wire = test_msgs_msg_dds__Blob_;

// Cyclone takes loopback for unable to multicast, which Fast DDS does on it all the same.
constexpr const char* configuration = R"(
  <CycloneDDS><Domain Id="any">
    <General><Interfaces><NetworkInterface name="lo" multicast="true"/></Interfaces></General>
    <Internal><SocketReceiveBufferSize min="200kB" max="4MB"/></Internal>
  </Domain></CycloneDDS>)";

dds_entity_t checked(dds_entity_t entity) {
  if (entity < 0) {
    throw std::runtime_error{std::string{"Cyclone DDS: "} + dds_strretcode(-entity)};
  }
  return entity;
}

struct DeleteQos {
  void operator()(dds_qos_t* qos) const { dds_delete_qos(qos); }
};

std::unique_ptr<dds_qos_t, DeleteQos> cyclone_qos(const dds::Qos& qos) {
  std::unique_ptr<dds_qos_t, DeleteQos> result{dds_create_qos()};
  dds_qset_reliability(result.get(), qos.reliable ? DDS_RELIABILITY_RELIABLE : DDS_RELIABILITY_BEST_EFFORT,
                       DDS_SECS(10));
  dds_qset_durability(result.get(),
                      qos.transient_local ? DDS_DURABILITY_TRANSIENT_LOCAL : DDS_DURABILITY_VOLATILE);
  dds_qset_history(result.get(), DDS_HISTORY_KEEP_LAST, static_cast<std::int32_t>(qos.depth));
  // What late readers get has a history of its own here.
  dds_qset_durability_service(result.get(), 0, DDS_HISTORY_KEEP_LAST, static_cast<std::int32_t>(qos.depth),
                              DDS_LENGTH_UNLIMITED, DDS_LENGTH_UNLIMITED, DDS_LENGTH_UNLIMITED);
  return result;
}

}  // namespace

struct CyclonePeer::Entities {
  dds_entity_t domain = 0;
  dds_entity_t participant = 0;
  dds_entity_t topic = 0;
  dds_entity_t writer = 0;
  dds_entity_t reader = 0;
};

CyclonePeer::CyclonePeer(std::uint32_t domain) : entities_{std::make_unique<Entities>()} {
  entities_->domain = checked(dds_create_domain(domain, configuration));
  entities_->participant = checked(dds_create_participant(domain, nullptr, nullptr));
  entities_->topic = checked(
      dds_create_topic(entities_->participant, &test_msgs_msg_dds__Blob__desc, blob_topic, nullptr, nullptr));
}

CyclonePeer::~CyclonePeer() {
  dds_delete(entities_->domain);
}

void CyclonePeer::open_writer(const dds::Qos& qos) {
  entities_->writer =
      checked(dds_create_writer(entities_->participant, entities_->topic, cyclone_qos(qos).get(), nullptr));
}

void CyclonePeer::open_reader(const dds::Qos& qos) {
  entities_->reader =
      checked(dds_create_reader(entities_->participant, entities_->topic, cyclone_qos(qos).get(), nullptr));
}

std::size_t CyclonePeer::readers_matched() const {
  dds_publication_matched_status_t status{};
  checked(dds_get_publication_matched_status(entities_->writer, &status));
  return status.current_count;
}

std::size_t CyclonePeer::writers_matched() const {
  dds_subscription_matched_status_t status{};
  checked(dds_get_subscription_matched_status(entities_->reader, &status));
  return status.current_count;
}

void CyclonePeer::write(const Blob& blob) {
  std::string text = blob.text;
  std::vector<std::byte> data = blob.data;
  Wire wire{};
  wire.number = blob.number;
  wire.text = text.data();
  wire.data._length = static_cast<std::uint32_t>(data.size());
  wire.data._maximum = wire.data._length;
  wire.data._buffer = static_cast<std::uint8_t*>(static_cast<void*>(data.data()));
  wire.data._release = false;
  checked(dds_write(entities_->writer, &wire));
}

std::optional<Blob> CyclonePeer::take() {
  void* sample = nullptr;
  dds_sample_info_t info{};
  if (checked(dds_take(entities_->reader, &sample, &info, 1, 1)) == 0) {
    return std::nullopt;
  }
  std::optional<Blob> result;
  if (info.valid_data) {
    const auto& wire = *static_cast<const Wire*>(sample);
    const auto* bytes = static_cast<const std::byte*>(static_cast<const void*>(wire.data._buffer));
    result = Blob{wire.number, wire.text, {bytes, bytes + wire.data._length}};
  }
  checked(dds_return_loan(entities_->reader, &sample, 1));
  return result;
}

}  // namespace trestle::test
