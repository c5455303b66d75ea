#include "bridge/describe/write/vsomeip/write_vsomeip.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <nlohmann/json.hpp>
#include <set>
#include <string_view>
#include <tuple>
#include <utility>

#include "bridge/describe/instance_index.hpp"
#include "bridge/describe/protection.hpp"
#include "someip/net/address_text.hpp"

namespace trestle::describe {
namespace {

using Json = nlohmann::ordered_json;
using std::chrono::duration_cast;
using std::chrono::milliseconds;

/// vsomeip reads all values from texts; numbers as JSON numbers would do too, but not in its older releases.
template <typename Number>
std::string text(Number number) {
  return std::to_string(number);
}
template <typename Id>
std::string id_text(Id id) {
  return fmt::format("0x{:04x}", someip::value(id));
}

/// An id that vsomeip takes: neither "none" nor "any".
template <typename Id>
bool is_usual(const std::optional<Id>& id) {
  return id && someip::value(*id) != 0 && someip::value(*id) != 0xffff;
}

/// vsomeip takes a whole multiple of 16 up to this, the default.
constexpr std::uint32_t usual_segment_bytes = 1392;
/// vsomeip keeps it in a byte.
constexpr std::uint32_t most_threshold = 255;

class VsomeipWriter {
 public:
  VsomeipWriter(const Model& model, const VsomeipOptions& options)
      : model_{model}, options_{options}, instances_{model} {}

  Written write() {
    Json services = Json::array();
    Json clients = Json::array();
    for (const Instance& instance : model_.instances) {
      const Service* service = service_of(instance);
      if (!is_usual(instance.id) || !is_usual(id_of(instance, service))) {
        lost(label_of(instance), "an instance without ids: vsomeip needs a service id and an instance id",
             instance.place);
        continue;
      }
      Json ids{{"service", id_text(*id_of(instance, service))}, {"instance", id_text(*instance.id)}};
      clients.push_back(ids);
      if (instance.role == Instance::Role::provided) {
        services.push_back(provided(std::move(ids), instance, service));
      }
    }
    tell_of_the_rest();

    Json server = common("service");
    server["services"] = services;
    Json client = common("client");
    client["clients"] = clients;
    Json tp = tp_of_clients();
    if (!tp.empty()) {
      client["services"] = std::move(tp);
    }
    return {{{"vsomeip-service.json", dump(server)}, {"vsomeip-client.json", dump(client)}},
            std::move(not_carried_)};
  }

 private:
  static std::string dump(const Json& json) {
    return json.dump(2, ' ', false, Json::error_handler_t::replace) + "\n";
  }
  void lost(std::string element, std::string what, Place place) {
    not_carried_.push_back({std::move(element), std::move(what), place});
  }

  [[nodiscard]] const Service* service_of(const Instance& instance) const {
    return instances_.service_of(instance);
  }
  static std::optional<someip::ServiceId> id_of(const Instance& instance, const Service* service) {
    return service != nullptr && service->id ? service->id : instance.service_id;
  }

  /// What both sides have.
  [[nodiscard]] Json common(const char* side) const {
    Json json = Json::object();
    const Machine* machine = model_.machines.empty() ? nullptr : &model_.machines.front();
    const bool is_server = std::string_view{side} == "service";
    const std::optional<IpAddress> address = is_server ? server_address() : options_.address;
    // Without one vsomeip takes 127.0.0.1, where nobody else is.
    if (address) {
      json["unicast"] = someip::to_string(*address);
    }
    const std::string name = options_.application + "-" + side;
    json["applications"] = Json::array(
        {Json{{"name", name}, {"id", fmt::format("0x{:04x}", options_.client_id + (is_server ? 0 : 1))}}});
    json["routing"] = name;
    json["service-discovery"] = discovery(machine);
    Json list = protections(is_server);
    if (!list.empty()) {
      json["e2e"] = Json{{"e2e_enabled", "true"}, {"protected", std::move(list)}};
    }
    return json;
  }

  /// That of the host that offers all provided instances.
  [[nodiscard]] std::optional<IpAddress> server_address() const {
    std::optional<IpAddress> address = options_.address;
    if (!address && !model_.machines.empty()) {
      address = model_.machines.front().address;
    }
    for (const Instance& one : model_.instances) {
      if (!address && one.role == Instance::Role::provided) {
        address = one.address;
      }
    }
    return address;
  }

  /// The instance whose times of service discovery a file has; null: none has any.
  [[nodiscard]] const Instance* timed() const {
    const auto found =
        std::ranges::find_if(model_.instances, [](const Instance& one) { return one.timing.has_value(); });
    return found == model_.instances.end() ? nullptr : &*found;
  }

  [[nodiscard]] Json discovery(const Machine* machine) const {
    Json json{{"enable", "true"}};
    json["multicast"] = machine != nullptr && machine->sd_multicast
                            ? someip::to_string(*machine->sd_multicast)
                            : std::string{"224.244.224.245"};
    json["port"] = text(machine != nullptr ? machine->sd_port.value_or(30490) : 30490);
    json["protocol"] = "udp";
    const Instance* const from = timed();
    const sd::Timing timing = from == nullptr ? sd::Timing{} : *from->timing;
    const auto time = [&json](const char* key, Duration duration) {
      json[key] = text(duration_cast<milliseconds>(duration).count());
    };
    time("initial_delay_min", timing.initial_delay_min);
    time("initial_delay_max", timing.initial_delay_max);
    time("repetitions_base_delay", timing.repetitions_base_delay);
    json["repetitions_max"] = text(timing.repetitions_max);
    json["ttl"] = text(timing.ttl_s);
    time("cyclic_offer_delay", timing.cyclic_offer_delay);
    time("request_response_delay", timing.request_response_delay_max);
    return json;
  }

  Json provided(Json json, const Instance& instance, const Service* service) {
    if (instance.tcp_port) {
      json["reliable"] = Json{{"port", text(*instance.tcp_port)}, {"enable-magic-cookies", "false"}};
    }
    if (instance.udp_port) {
      json["unreliable"] = text(*instance.udp_port);
    }
    if (!instance.udp_port && !instance.tcp_port) {
      lost(label_of(instance), "no port: vsomeip offers it to this host alone", instance.place);
    }
    if (service == nullptr) {
      return json;
    }
    if (Json list = events(*service); !list.empty()) {
      json["events"] = std::move(list);
    }
    if (Json list = eventgroups(*service, instance); !list.empty()) {
      json["eventgroups"] = std::move(list);
    }
    if (Json tp = tp_of(*service); !tp.empty()) {
      json["someip-tp"] = std::move(tp);
    }
    if (Json times = debounce(*service); !times.empty()) {
      json["debounce-times"] = std::move(times);
    }
    return json;
  }

  [[nodiscard]] static Json event(someip::MethodId id, bool is_field, const Transfer& transfer,
                                  std::optional<std::chrono::microseconds> cycle) {
    Json json{{"event", id_text(id)},
              {"is_field", is_field ? "true" : "false"},
              {"is_reliable", transfer.transport == Transport::tcp ? "true" : "false"}};
    if (cycle && duration_cast<milliseconds>(*cycle).count() > 0) {
      json["cycle"] = text(duration_cast<milliseconds>(*cycle).count());
    }
    return json;
  }
  [[nodiscard]] static Json events(const Service& service) {
    Json list = Json::array();
    for (const Event& one : service.events) {
      if (is_usual(one.id)) {
        list.push_back(event(*one.id, false, one.transfer, one.cycle));
      }
    }
    for (const Field& one : service.fields) {
      if (one.has_notifier && is_usual(one.notifier)) {
        list.push_back(event(*one.notifier, true, one.notifier_transfer, one.cycle));
      }
    }
    return list;
  }

  [[nodiscard]] static Json eventgroups(const Service& service, const Instance& instance) {
    std::map<someip::EventgroupId, std::vector<std::string>> members;
    const auto add = [&](const auto& one, const std::optional<someip::MethodId>& id) {
      if (is_usual(id)) {
        for (const someip::EventgroupId group : std::set(one.eventgroups.begin(), one.eventgroups.end())) {
          members[group].push_back(id_text(*id));
        }
      }
    };
    for (const Event& one : service.events) {
      add(one, one.id);
    }
    for (const Field& one : service.fields) {
      add(one, one.notifier);
    }
    Json list = Json::array();
    for (const Eventgroup& group : service.eventgroups) {
      if (!is_usual(std::optional{group.id})) {
        continue;
      }
      Json json{{"eventgroup", id_text(group.id)}};
      const auto there = members.find(group.id);
      json["events"] = there == members.end() ? Json::array() : Json(there->second);
      for (const Multicast& one : instance.multicast) {
        if (one.eventgroup == group.id) {
          json["multicast"] =
              Json{{"address", someip::to_string(one.group.address)}, {"port", text(one.group.port)}};
          json["threshold"] = text(std::min(one.threshold, most_threshold));
        }
      }
      list.push_back(std::move(json));
    }
    return list;
  }

  /// A method or event with its segments; the short form where all is as usual.
  static bool has_segments(const Transfer& transfer) {
    return transfer.segment_bytes != 0 || transfer.separation.count() != 0;
  }
  static std::uint32_t segment_bytes_of(const Transfer& transfer) {
    return transfer.segment_bytes < 16 ? usual_segment_bytes
                                       : std::min(transfer.segment_bytes, usual_segment_bytes) / 16 * 16;
  }
  static void segments(const std::optional<someip::MethodId>& id, const Transfer& transfer, Json& list) {
    if (!is_usual(id) || !has_segments(transfer)) {
      return;
    }
    const std::uint32_t bytes = segment_bytes_of(transfer);
    if (bytes == usual_segment_bytes && transfer.separation.count() == 0) {
      list.push_back(id_text(*id));
      return;
    }
    list.push_back(Json{{"method", id_text(*id)},
                        {"max-segment-length", text(bytes)},
                        {"separation-time", text(transfer.separation.count())}});
  }
  [[nodiscard]] static Json tp_of(const Service& service) {
    Json requests = Json::array();
    Json responses = Json::array();
    for (const Method& one : service.methods) {
      segments(one.id, one.request_transfer, requests);
      segments(one.id, one.response_transfer, responses);
    }
    for (const Field& one : service.fields) {
      segments(one.setter, one.setter_transfer, requests);
      segments(one.getter, one.getter_transfer, responses);
      segments(one.setter, one.setter_transfer, responses);
      segments(one.notifier, one.notifier_transfer, responses);
    }
    for (const Event& one : service.events) {
      segments(one.id, one.transfer, responses);
    }
    Json json = Json::object();
    if (!requests.empty()) {
      json["client-to-service"] = std::move(requests);
    }
    if (!responses.empty()) {
      json["service-to-client"] = std::move(responses);
    }
    return json;
  }

  /// Times by id, in the order of the members. An ordered_json object would look through all at each new one.
  class Times {
   public:
    void add(const std::optional<someip::MethodId>& id, const Transfer& transfer) {
      if (is_usual(id) && (transfer.debounce.count() != 0 || transfer.retention.count() != 0) &&
          known_.insert(*id).second) {
        all_.emplace_back(
            id_text(*id),
            Json{{"debounce-time", text(duration_cast<milliseconds>(transfer.debounce).count())},
                 {"maximum-retention-time", text(duration_cast<milliseconds>(transfer.retention).count())}});
      }
    }
    [[nodiscard]] bool empty() const { return all_.empty(); }
    [[nodiscard]] Json take() const { return Json::object_t(all_.begin(), all_.end()); }

   private:
    std::set<someip::MethodId> known_;
    std::vector<std::pair<const std::string, Json>> all_;
  };
  [[nodiscard]] static Json debounce(const Service& service) {
    Times requests;
    Times responses;
    for (const Method& one : service.methods) {
      requests.add(one.id, one.request_transfer);
      responses.add(one.id, one.response_transfer);
    }
    for (const Field& one : service.fields) {
      responses.add(one.getter, one.getter_transfer);
      requests.add(one.setter, one.setter_transfer);
      responses.add(one.notifier, one.notifier_transfer);
    }
    for (const Event& one : service.events) {
      responses.add(one.id, one.transfer);
    }
    Json json = Json::object();
    if (!requests.empty()) {
      json["requests"] = requests.take();
    }
    if (!responses.empty()) {
      json["responses"] = responses.take();
    }
    return json;
  }

  /// A client has to be told, too, what it sends and gets in segments. vsomeip finds that by the endpoint of
  /// the service.
  [[nodiscard]] Json tp_of_clients() const {
    Json list = Json::array();
    for (const Instance& instance : model_.instances) {
      const Service* service = service_of(instance);
      if (service == nullptr || !is_usual(instance.id) || !is_usual(service->id)) {
        continue;
      }
      if (Json tp = tp_of(*service); !tp.empty()) {
        Json json{{"service", id_text(*service->id)}, {"instance", id_text(*instance.id)}};
        if (instance.address) {
          json["unicast"] = someip::to_string(*instance.address);
        }
        if (instance.udp_port) {
          json["unreliable"] = text(*instance.udp_port);
        }
        json["someip-tp"] = std::move(tp);
        list.push_back(std::move(json));
      }
    }
    return list;
  }

  /// Each protected message as both, because methods are sent and received by either side.
  [[nodiscard]] Json protections(bool is_server) const {
    Json list = Json::array();
    for (const Service& service : model_.services) {
      const auto add = [&](const std::optional<someip::MethodId>& id, const Protection& e2e, bool is_method) {
        if (!is_usual(service.id) || !is_usual(id) || !profile_name(e2e)) {
          return;
        }
        for (const bool sends : {true, false}) {
          if (is_method || sends == is_server) {
            list.push_back(protection(*service.id, *id, e2e, sends));
          }
        }
      };
      for (const Event& one : service.events) {
        add(one.id, one.e2e, false);
      }
      for (const Field& one : service.fields) {
        add(one.notifier, one.e2e, false);
        add(one.getter, one.getter_e2e, true);
        add(one.setter, one.setter_e2e, true);
      }
      for (const Method& one : service.methods) {
        add(one.id, one.e2e, true);
      }
    }
    return list;
  }
  [[nodiscard]] static const char* profile_name(const Protection& e2e) {
    const auto word = [&](const char* key) {
      const auto found = e2e.words.find(key);
      return found == e2e.words.end() ? std::string{} : found->second;
    };
    if (e2e.profile == "4") {
      return "P04";
    }
    if (e2e.profile == "7") {
      return "P07";
    }
    if (e2e.profile == "5") {
      return word("crc_order") == "big" ? "P05" : nullptr;
    }
    return e2e.profile == "1" && word("payload_only") == "true" && word("data_id_mode") != "alternating"
               ? "P01"
               : nullptr;
  }
  [[nodiscard]] static Json protection(someip::ServiceId service, someip::MethodId id, const Protection& e2e,
                                       bool sends) {
    Json json{{"service_id", id_text(service)},
              {"event_id", id_text(id)},
              {"profile", profile_name(e2e)},
              {"variant", sends ? "protector" : "checker"}};
    const auto put = [&](const char* ours, const char* key, std::optional<std::uint64_t> otherwise) {
      const auto found = e2e.numbers.find(ours);
      if (found != e2e.numbers.end()) {
        json[key] = text(found->second);
      } else if (otherwise) {
        json[key] = text(*otherwise);
      }
    };
    if (e2e.profile == "1") {
      put("crc_offset_bits", "crc_offset", 0);
      put("counter_offset_bits", "counter_offset", 8);
      put("data_id_nibble_offset_bits", "data_id_nibble_offset", 12);
      put("data_bits", "data_length", std::nullopt);
      const auto mode = e2e.words.find("data_id_mode");
      json["data_id_mode"] = mode == e2e.words.end() || mode->second == "both" ? "0"
                             : mode->second == "low"                           ? "2"
                                                                               : "3";
    } else {
      put("offset_bits", "crc_offset", 64);
      put("data_bits", "data_length", std::nullopt);
      put("min_data_bits", "min_data_length", std::nullopt);
      put("max_data_bits", "max_data_length", std::nullopt);
      put("max_delta_counter", "max_delta_counter", 1);
    }
    put("data_id", "data_id", std::nullopt);
    return json;
  }

  void version(const Service& service, const std::string& name) {
    if (service.has_version || service.major != 1 || service.minor != 0) {
      lost(name, fmt::format("its version: {}.{}", service.major, service.minor), service.place);
    }
    for (const Instance* const one : instances_.of(service)) {
      if (one->major.value_or(service.major) != service.major ||
          one->minor.value_or(service.minor) != service.minor) {
        lost(label_of(*one), "a version of the instance's own", one->place);
      }
    }
  }
  /// Whether the file has the events and times of a service: those that it offers have them.
  [[nodiscard]] bool is_offered(const Service& service) const {
    return std::ranges::any_of(instances_.of(service), [](const Instance* one) {
      return one->id && one->role == Instance::Role::provided;
    });
  }
  static bool has_times(const Transfer& transfer) {
    return transfer.debounce.count() != 0 || transfer.retention.count() != 0;
  }
  /// A method is in the file where something is set for it.
  static bool has_settings(const Method& method, bool is_offered) {
    const auto is_set = [&](const Transfer& transfer) {
      return has_segments(transfer) || (is_offered && has_times(transfer));
    };
    return (!method.e2e.profile.empty() && profile_name(method.e2e) != nullptr) ||
           is_set(method.request_transfer) || is_set(method.response_transfer);
  }
  /// What of segments and times such a file has no number for.
  void numbers(const std::string& element, const Transfer& transfer, const Place& place) {
    if (has_segments(transfer) && transfer.segment_bytes != 0 &&
        segment_bytes_of(transfer) != transfer.segment_bytes) {
      lost(element,
           fmt::format("segments of {} bytes: a multiple of 16, of at most {}, here {}",
                       transfer.segment_bytes, usual_segment_bytes, segment_bytes_of(transfer)),
           place);
    }
    whole_milliseconds(element, transfer.debounce, place);
    whole_milliseconds(element, transfer.retention, place);
  }
  void whole_milliseconds(const std::string& element, Duration time, const Place& place) {
    if (time != duration_cast<milliseconds>(time)) {
      lost(element, fmt::format("times in µs: {}", duration_cast<std::chrono::microseconds>(time).count()),
           place);
    }
  }

  /// @param host  server_address()
  void tell_of_address(const Instance& instance, const std::optional<IpAddress>& host) {
    if (instance.address && host && *instance.address != *host) {
      lost(label_of(instance),
           fmt::format("its address {}: the file is that of one host, {}",
                       someip::to_string(*instance.address), someip::to_string(*host)),
           instance.place);
    }
  }
  void tell_of_multicast(const Instance& instance) {
    const Service* const service = service_of(instance);
    for (const Multicast& one : instance.multicast) {
      if (service == nullptr || std::ranges::find(service->eventgroups, one.eventgroup, &Eventgroup::id) ==
                                    service->eventgroups.end()) {
        lost(label_of(instance),
             fmt::format("the group of an eventgroup that its service does not have: {}",
                         id_text(one.eventgroup)),
             instance.place);
      } else if (one.threshold > most_threshold) {
        lost(label_of(instance),
             fmt::format("its threshold of {} subscribers: vsomeip has at most {}", one.threshold,
                         most_threshold),
             instance.place);
      }
    }
  }
  /// @param from  timed()
  void tell_of_discovery(const Instance& instance, const Instance* from) {
    if (!instance.timing || from == nullptr) {
      return;
    }
    if (*instance.timing != *from->timing) {
      lost(label_of(instance),
           "its times of service discovery: a file has those of one instance, " + label_of(*from),
           instance.place);
      return;
    }
    if (&instance != from) {
      return;
    }
    const sd::Timing& timing = *instance.timing;
    if (timing.request_response_delay_min.count() != 0) {
      lost(label_of(instance), "its least delay of answers", instance.place);
    }
    for (const Duration time :
         {timing.initial_delay_min, timing.initial_delay_max, timing.repetitions_base_delay,
          timing.cyclic_offer_delay, timing.request_response_delay_max}) {
      whole_milliseconds(label_of(instance), time, instance.place);
    }
  }

  /// Whether a client can choose UDP for a method.
  [[nodiscard]] bool has_udp(const Service& service) const {
    const std::vector<const Instance*> all = instances_.of(service);
    return all.empty() ||
           std::ranges::any_of(all, [](const Instance* one) { return one->udp_port || !one->tcp_port; });
  }

  void tell_of_the_rest() {
    for (const Service& service : model_.services) {
      const std::string name = full_name(service.scope, service.name);
      if (!service.id) {
        lost(name, "a service without id", service.place);
        continue;
      }
      if (instances_.of(service).empty()) {
        lost(name, "a service without instance", service.place);
      }
      version(service, name);
      for (const Eventgroup& group : service.eventgroups) {
        if (!is_usual(std::optional{group.id})) {
          lost(name, "an eventgroup without id: " + group.name, group.place);
        }
      }
      const auto protection = [&](const std::string& member, const Protection& e2e, const Place& place) {
        if (!e2e.profile.empty() && profile_name(e2e) == nullptr) {
          lost(name + "." + member, "E2E profile " + e2e.profile, place);
        }
        if (const std::string others = other_instances(e2e); !others.empty()) {
          lost(name + "." + member, "E2E protection of each instance, here one for all: " + others, place);
        }
      };
      const auto e2e = [&](const auto& one) { protection(one.name, one.e2e, one.place); };
      // One without any instance is told of as a whole.
      const bool offered = is_offered(service) || instances_.of(service).empty();
      const auto event = [&](const auto& one, const Transfer& transfer) {
        const std::string element = name + "." + one.name;
        if (!offered) {
          lost(element, "an event of a service that is used and not offered", one.place);
        }
        numbers(element, transfer, one.place);
        whole_milliseconds(element, one.cycle.value_or(std::chrono::microseconds{0}), one.place);
      };
      for (const Event& one : service.events) {
        e2e(one);
        event(one, one.transfer);
        if (!is_usual(one.id)) {
          lost(name + "." + one.name, "an event without id", one.place);
        }
        if (one.eventgroups.empty()) {
          lost(name + "." + one.name, "no eventgroup: nobody can subscribe to it", one.place);
        }
        if (one.selective) {
          lost(name + "." + one.name, "selective", one.place);
        }
      }
      const bool may_be_udp = has_udp(service);
      const auto transport = [&](const std::string& element, const Transfer& transfer, const Place& place) {
        if (may_be_udp && transfer.transport == Transport::tcp) {
          lost(element, "that it is carried by TCP: a client takes either port", place);
        }
      };
      for (const Method& one : service.methods) {
        e2e(one);
        transport(name + "." + one.name, one.request_transfer, one.place);
        numbers(name + "." + one.name, one.request_transfer, one.place);
        numbers(name + "." + one.name, one.response_transfer, one.place);
        if (!is_usual(one.id)) {
          lost(name + "." + one.name, "a method without id", one.place);
        } else if (!has_settings(one, offered)) {
          lost(name + "." + one.name,
               fmt::format("the method {}: there is a place for its settings alone, and it has none",
                           id_text(*one.id)),
               one.place);
        }
        if (one.fire_and_forget) {
          lost(name + "." + one.name, "that it has no answer", one.place);
        }
        if (one.timeout) {
          lost(name + "." + one.name, "its timeout", one.place);
        }
      }
      for (const Field& one : service.fields) {
        e2e(one);
        if (one.has_notifier) {
          if (!is_usual(one.notifier)) {
            lost(name + "." + one.name, "an event without id", one.place);
          }
          event(one, one.notifier_transfer);
        }
        if (one.has_getter) {
          numbers(name + "." + one.name + ".get", one.getter_transfer, one.place);
        }
        if (one.has_setter) {
          numbers(name + "." + one.name + ".set", one.setter_transfer, one.place);
        }
        if (one.has_getter || one.has_setter) {
          std::string parts;
          for (const auto& [there, part, id] :
               {std::tuple{one.has_getter, "getter", one.getter}, {one.has_setter, "setter", one.setter}}) {
            if (there) {
              parts += fmt::format("{}{} {}", parts.empty() ? "" : ", ", part, id ? id_text(*id) : "");
            }
          }
          lost(name + "." + one.name, "which methods read and write it: " + parts, one.place);
        }
        if (one.has_getter) {
          transport(name + "." + one.name + ".get", one.getter_transfer, one.place);
        }
        if (one.has_setter) {
          transport(name + "." + one.name + ".set", one.setter_transfer, one.place);
        }
        if (one.has_notifier && one.eventgroups.empty()) {
          lost(name + "." + one.name, "no eventgroup: nobody can subscribe to it", one.place);
        }
        protection(one.name + ".get", one.getter_e2e, one.place);
        protection(one.name + ".set", one.setter_e2e, one.place);
      }
    }
    const std::optional<IpAddress> host = server_address();
    const Instance* const from = timed();
    for (const Instance& one : model_.instances) {
      if (!one.configuration.empty()) {
        lost(label_of(one), "configuration options", one.place);
      }
      if (one.priority || one.weight) {
        lost(label_of(one), "load balancing", one.place);
      }
      if (one.role == Instance::Role::provided) {
        tell_of_address(one, host);
        tell_of_multicast(one);
      }
      tell_of_discovery(one, from);
    }
  }

  const Model& model_;
  const VsomeipOptions& options_;
  InstanceIndex instances_;
  std::vector<NotCarried> not_carried_;
};

}  // namespace

Written write_vsomeip(const Model& model, const VsomeipOptions& options) {
  return VsomeipWriter{model, options}.write();
}

}  // namespace trestle::describe
