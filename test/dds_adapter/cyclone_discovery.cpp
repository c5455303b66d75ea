#include "test/dds_adapter/cyclone_discovery.hpp"

#include <dds/dds.h>

#include <array>
#include <stdexcept>

namespace trestle::test {

namespace {

dds_entity_t made(dds_entity_t entity) {
  if (entity < 0) {
    throw std::runtime_error{std::string{"Cyclone DDS: "} + dds_strretcode(-entity)};
  }
  return entity;
}

std::string user_data(const dds_qos_t* qos) {
  void* value = nullptr;
  std::size_t size = 0;
  if (!dds_qget_userdata(qos, &value, &size)) {
    return {};
  }
  std::string text{static_cast<const char*>(value), size};
  dds_free(value);
  return text;
}

/// Calls `each` with the samples of a built-in topic whose subjects live.
template <typename BuiltinSample, typename Each>
void read_all(dds_entity_t reader, const Each& each) {
  constexpr std::size_t most = 256;
  std::array<void*, most> samples{};
  std::array<dds_sample_info_t, most> infos{};
  const int count = made(dds_read_mask(reader, samples.data(), infos.data(), most, most,
                                       DDS_ANY_SAMPLE_STATE | DDS_ANY_VIEW_STATE | DDS_ALIVE_INSTANCE_STATE));
  for (std::size_t i = 0; i < static_cast<std::size_t>(count); ++i) {
    if (infos[i].valid_data) {
      each(*static_cast<const BuiltinSample*>(samples[i]));
    }
  }
  made(dds_return_loan(reader, samples.data(), count));
}

std::vector<std::string> of_topic(dds_entity_t reader, const std::string& topic) {
  std::vector<std::string> result;
  read_all<dds_builtintopic_endpoint_t>(reader, [&](const dds_builtintopic_endpoint_t& endpoint) {
    if (topic == endpoint.topic_name) {
      result.push_back(user_data(endpoint.qos));
    }
  });
  return result;
}

}  // namespace

struct CycloneDiscovery::Entities {
  dds_entity_t domain = 0;
  dds_entity_t participants = 0;
  dds_entity_t writers = 0;
  dds_entity_t readers = 0;
};

CycloneDiscovery::CycloneDiscovery(std::uint32_t domain) : entities_{std::make_unique<Entities>()} {
  // As in cyclone_peer.cpp.
  constexpr const char* configuration = R"(
    <CycloneDDS><Domain Id="any">
      <General><Interfaces><NetworkInterface name="lo" multicast="true"/></Interfaces></General>
    </Domain></CycloneDDS>)";
  entities_->domain = made(dds_create_domain(domain, configuration));
  const dds_entity_t participant = made(dds_create_participant(domain, nullptr, nullptr));
  const auto reader = [&](dds_entity_t topic) {
    return made(dds_create_reader(participant, topic, nullptr, nullptr));
  };
  entities_->participants = reader(DDS_BUILTIN_TOPIC_DCPSPARTICIPANT);
  entities_->writers = reader(DDS_BUILTIN_TOPIC_DCPSPUBLICATION);
  entities_->readers = reader(DDS_BUILTIN_TOPIC_DCPSSUBSCRIPTION);
}

CycloneDiscovery::~CycloneDiscovery() {
  dds_delete(entities_->domain);
}

std::vector<std::string> CycloneDiscovery::participants() const {
  std::vector<std::string> result;
  read_all<dds_builtintopic_participant_t>(
      entities_->participants,
      [&](const dds_builtintopic_participant_t& one) { result.push_back(user_data(one.qos)); });
  return result;
}

std::vector<std::string> CycloneDiscovery::writers(const std::string& topic) const {
  return of_topic(entities_->writers, topic);
}

std::vector<std::string> CycloneDiscovery::readers(const std::string& topic) const {
  return of_topic(entities_->readers, topic);
}

}  // namespace trestle::test
