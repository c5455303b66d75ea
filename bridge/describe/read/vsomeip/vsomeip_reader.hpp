#pragma once
#include <algorithm>
#include <chrono>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <tuple>
#include <utility>
#include <vector>

#include "bridge/describe/contradictions.hpp"
#include "bridge/describe/model.hpp"
#include "bridge/describe/read/problems.hpp"
#include "bridge/describe/read/vsomeip/json_tree.hpp"
#include "bridge/describe/read/vsomeip/vsomeip_keys.hpp"

namespace trestle::describe {

/// What vsomeip does when its configuration says nothing.
inline constexpr sd::Timing vsomeip_timing{.initial_delay_min = std::chrono::milliseconds{0},
                                           .initial_delay_max = std::chrono::milliseconds{3000},
                                           .repetitions_base_delay = std::chrono::milliseconds{10},
                                           .repetitions_max = 3,
                                           .cyclic_offer_delay = std::chrono::milliseconds{1000},
                                           .request_response_delay_min = std::chrono::milliseconds{0},
                                           .request_response_delay_max = std::chrono::milliseconds{2000},
                                           .ttl_s = 0xff'ffff};

/// Members from here on are events.
inline constexpr std::uint16_t first_event_id = 0x8000;

/// What holds for a whole host, and has to be known of all its files before instances are complete. A file
/// with another "unicast" is of another host.
struct VsomeipHost {
  std::string name{};  ///< made of that of its first file
  /// As they are written, and where: of two files of one host, both have to say the same.
  std::map<std::string_view, SaidValue> said{};
  std::string unicast{};  ///< as it is written, also if it is still to be filled in
  std::optional<IpAddress> address{};
  std::optional<IpAddress> sd_multicast{};
  std::optional<std::uint16_t> sd_port{};
  bool sd = true;
  sd::Timing timing = vsomeip_timing;
  Transfer requests{};  ///< "npdu-default-timings"
  Transfer responses{};
};

/// What an entry for an event says.
struct VsomeipEvent {
  someip::MethodId id{};
  std::optional<someip::InstanceId> instance{};
  Place place{};
  bool is_field = false;
  Transport transport = Transport::udp;
  std::optional<std::chrono::microseconds> cycle{};
  // Where the entry says these.
  std::optional<Place> is_field_at{};
  std::optional<Place> transport_at{};
  std::optional<Place> cycle_at{};
};

/// Makes a model of vsomeip's configurations.
class VsomeipReader {
 public:
  /// @param problems  of each file of the model.
  VsomeipReader(Model& model, std::vector<Problems>& problems) : model_{model}, problems_{problems} {}

  void read(const JsonNode& root, std::uint32_t file);
  /// After all files.
  void finish();

 private:
  struct Protected {
    someip::ServiceId service{};
    someip::MethodId id{};
    Protection e2e;
    Place place;
  };

  // How values are written.
  /// A number as vsomeip writes them, in decimal or with 0x in front; nothing for other texts.
  [[nodiscard]] static std::optional<std::uint64_t> whole(std::string_view text);
  /// "__PORT__", "${PORT}", "@PORT@": a script fills it in.
  [[nodiscard]] static bool is_placeholder(const JsonNode* node);
  /// With a warning about a placeholder, which counts as not given.
  [[nodiscard]] bool to_be_filled_in(const JsonNode& node, const std::string& what);
  [[nodiscard]] std::optional<std::uint64_t> number(const JsonNode* node, const std::string& what,
                                                    std::uint64_t min, std::uint64_t max);
  /// An id that is needed: a placeholder for it is an error.
  template <typename Id>
  [[nodiscard]] std::optional<Id> id(const JsonNode* node, const std::string& what) {
    if (is_placeholder(node)) {
      error(*node, "expected " + what + ", which is still to be filled in: " + documents::quote(node->text));
      return std::nullopt;
    }
    const auto number = this->number(node, what, 1, 0xfffe);
    return number ? std::optional{static_cast<Id>(*number)} : std::nullopt;
  }
  /// An instance id, which may be missing: 0 and a placeholder stand for that, with a warning.
  [[nodiscard]] std::optional<someip::InstanceId> instance_id(const JsonNode* node, std::uint16_t max);
  [[nodiscard]] std::optional<std::uint16_t> port(const JsonNode* node, const std::string& what);
  [[nodiscard]] bool truth(const JsonNode* node, bool otherwise);
  [[nodiscard]] std::optional<IpAddress> address(const JsonNode* node, const std::string& what);
  [[nodiscard]] std::optional<std::chrono::milliseconds> milliseconds(const JsonNode* node,
                                                                      const std::string& what);
  /// Calls for each element of a list; a single one counts as a list of one, as in vsomeip.
  template <typename Each>
  void each(const JsonNode* node, const std::string& what, JsonNode::Kind kind, const Each& each);
  [[nodiscard]] const JsonNode* object(const JsonNode* node, const std::string& what);

  /// Warns of keys that vsomeip does not know; of each once, however many objects have it.
  void check_keys(const JsonNode& node, const VsomeipKeys& known);
  /// Warns of something that is left out, once.
  void left_out(const JsonNode* member, const std::string& what);

  void error(const JsonNode& node, std::string text) { problems().error(node.mark, std::move(text)); }
  void warning(const JsonNode& node, std::string text) { problems().warning(node.mark, std::move(text)); }
  [[nodiscard]] Problems& problems() { return problems_[file_]; }
  [[nodiscard]] Place place(const JsonNode& node) const { return {file_, node.mark}; }

  // What the parts of a configuration mean.
  /// The host that a file is of.
  void find_host(const JsonNode& root);
  [[nodiscard]] VsomeipHost& host() { return hosts_[host_]; }
  /// Notes a setting of the host. Of two files that say something else the first holds, and this is told.
  /// @param setting  as in Instance::said_at
  /// @return whether it holds.
  [[nodiscard]] bool says(std::string_view setting, const JsonNode& node);
  /// That of its host, where the instance has none of its own.
  static void take_address(Instance& instance, const VsomeipHost& host);
  void append_instance(Instance instance);
  /// Of several descriptions of one instance by one host, what each adds is taken, and they have to say the
  /// same. Of a client of another host, the endpoint has to be the same.
  void add_description(Instance instance, const JsonNode& node);
  /// @param index  of Model::instances.
  void join(std::size_t index, const Instance& other);
  /// Where nobody says how a message is carried.
  static void set_transports(Service& service, const Instance& instance);
  /// Whether there is time left to compare one more description with `known`; otherwise tells of it.
  [[nodiscard]] bool can_compare(const Instance& known, const Instance& other, const JsonNode& node);
  void discovery(const JsonNode& node);
  void delays(const JsonNode& node);
  void repetitions(const JsonNode* node, const std::string& what);
  void ttl(const JsonNode* node);
  void npdu_defaults(const JsonNode& node);
  void services(const JsonNode* node);
  void service(const JsonNode& node);
  void events(const JsonNode& node, Service& service, const Instance& instance);
  /// Makes fields of the events that are some. After all files: any may say it.
  void make_fields(Service& service);
  /// What the entries of a service say of its events, those of its eventgroups included: one for each event.
  [[nodiscard]] std::vector<VsomeipEvent> events_of(const JsonNode& node, const Instance& instance);
  [[nodiscard]] std::optional<VsomeipEvent> event(const JsonNode& node, const Instance& instance);
  /// Adds what `other` says and `event` does not.
  void join(VsomeipEvent& event, const VsomeipEvent& other);
  /// Tells of a setting of a message that is said differently: of two instances with a warning, as vsomeip
  /// lets each have its own.
  void differ(const std::string& message, std::string_view what, const SaidValue& first,
              const SaidValue& second, bool is_one_instance);
  /// The UDP or TCP port of a service.
  [[nodiscard]] std::optional<std::uint16_t> endpoint(const JsonNode* node, const std::string& what);
  [[nodiscard]] std::optional<Endpoint> shared_group(const JsonNode& service);
  /// Where an eventgroup is sent to many, into Instance::multicast.
  void group(const JsonNode& node, someip::EventgroupId id, const std::optional<Endpoint>& shared,
             Instance& instance);
  void eventgroup(const JsonNode& node, const std::optional<Endpoint>& shared, std::size_t service,
                  Instance& instance);
  void multicast(const JsonNode& node, const std::optional<Endpoint>& shared, Multicast& group);
  void in_eventgroup(const JsonNode& node, someip::EventgroupId group, Service& service,
                     const Instance& instance);
  void tp(const JsonNode& node, Service& service, const Instance& instance);
  void tp_of(const JsonNode& node, bool is_request, Service& service, const Instance& instance);
  void debounce(const JsonNode& node, bool is_request, Service& service, const Instance& instance);
  void client(const JsonNode& node);
  void protection(const JsonNode& node);
  void profile(const JsonNode& node, std::string_view name, Protection& e2e);
  void protect(const Protected& one);

  /// One direction of a method, or an event, in the words of an instance.
  struct Message {
    Service& service;
    someip::MethodId id;
    bool is_request;
    const Instance& instance;
  };
  /// Notes a setting of a message. Where one was said before that is another, that one holds, and this is
  /// told.
  /// @return whether it holds.
  [[nodiscard]] bool says(const Message& message, std::string_view what, std::string text,
                          const JsonNode& node);
  [[nodiscard]] Transfer& transfer_of(const Message& message, const JsonNode& node);

  std::size_t service_of(someip::ServiceId id, const Place& at);
  /// These are made where there are none.
  Event& event_of(Service& service, someip::MethodId id, const Instance& instance, const Place& at);
  Method& method_of(Service& service, someip::MethodId id, const Instance& instance, const Place& at);

  using EventKey = std::pair<someip::ServiceId, someip::MethodId>;
  using InstanceKey = std::pair<someip::ServiceId, std::optional<someip::InstanceId>>;
  [[nodiscard]] bool has_event(const Service& service, someip::MethodId id) const {
    return events_.contains({*service.id, id});
  }

  Model& model_;
  // Where things are, because a hostile file can have hundreds of thousands of them.
  std::map<someip::ServiceId, std::size_t> services_;
  std::map<EventKey, std::size_t> events_;
  std::map<EventKey, std::size_t> methods_;
  std::map<someip::EventgroupId, std::size_t> multicast_;      ///< of the instance that is being read
  std::map<InstanceKey, std::vector<std::size_t>> described_;  ///< indices of Model::instances
  std::set<InstanceKey> required_;
  /// Where the ports are not in the description that has the messages, or not all of them: of which instance
  /// (an index of Model::instances) the ports tell.
  std::map<someip::ServiceId, std::size_t> transports_;
  std::map<EventKey, VsomeipEvent> said_events_;
  std::map<std::tuple<EventKey, bool, std::string_view>, std::pair<SaidValue, InstanceKey>> said_messages_;
  std::size_t compared_ = 0;
  std::set<std::pair<std::string_view, std::string>> told_keys_;
  std::vector<VsomeipHost> hosts_;
  std::size_t host_ = 0;
  std::vector<std::size_t> hosts_of_instances_;
  std::vector<Protected> protected_;
  std::map<EventKey, Place> protected_at_;
  std::uint32_t file_ = 0;
  std::vector<Problems>& problems_;
  someip::ServiceId stand_in_{0xffff};  ///< of the next service whose id is wrong
  Contradictions contradictions_{model_,
                                 [this](const Place& place, std::string text) {
                                   problems_[place.file].error(place.mark, std::move(text));
                                 },
                                 [this](const Place& place, std::string text) {
                                   problems_[place.file].warning(place.mark, std::move(text));
                                 }};
};

template <typename Each>
void VsomeipReader::each(const JsonNode* node, const std::string& what, JsonNode::Kind kind,
                         const Each& each) {
  if (node == nullptr) {
    return;
  }
  const auto one = [&](const JsonNode& element) {
    if (kind == JsonNode::Kind::object && element.kind != kind) {
      error(element, "expected " + what + ", an object, not " + what_it_is(element));
    } else {
      each(element);
    }
  };
  if (node->kind == JsonNode::Kind::array) {
    std::ranges::for_each(node->elements, one);
  } else if (!(node->is_scalar() && node->text.empty())) {  // "" is vsomeip's empty list
    one(*node);
  }
}

}  // namespace trestle::describe
