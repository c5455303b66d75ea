// bridge/describe: interface descriptions. One model of what a system's SOME/IP interfaces are, whoever wrote
// it down.
//
//   model.hpp       services, types, instances, as plain values
//   model_json.hpp  the model as JSON: docs/describe.md
//   layout.hpp      what the bytes of a payload are
//   read/           readers: FIDL and FDEPL, ARXML, vsomeip JSON
//   sources/        loads files of any kind, .msg and .srv among them, and has each read by its reader
//   write/          writers: the same languages, route files, .msg packages, sheets, Wireshark profiles
//   lower.hpp       types and members as ROS definitions with wire rules: what routes and tools convert by
//   refused.hpp     which of these a bridge would refuse
//   raise.hpp       ROS definitions as types of a model
//   model_source.hpp  what lower.hpp makes, for a TypeLibrary
//   compare.hpp     what has changed between two models
//   load_e2e.hpp, protection.hpp  end-to-end protection: its keys, and where its header is in a payload
//   member_names.hpp  which service and member a name means
//   interfaces.hpp    what names mean, what ids are called, what payloads say: for tools
//
// Captures are read by bridge/generate. Nothing here opens a file, a socket or a clock, except
// sources/sources.hpp, which loads files. Readers get text and return a model with problems; a model with
// errors is not used.
#pragma once
#include <bit>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <vector>

#include "bridge/documents/problem.hpp"
#include "bridge/messages/types/message_definition.hpp"
#include "sd/core/settings.hpp"
#include "someip/wire/endpoint.hpp"
#include "someip/wire/payload_rules.hpp"
#include "someip/wire/tag.hpp"
#include "someip/wire/types.hpp"

namespace trestle::describe {

/// Where something was read: `file` is an index of Model::files. Ids may stand elsewhere than what has them:
/// in a FDEPL file, not in the FIDL. Without a line they stand where it does.
using documents::Place;

/// What people wrote beside an element, for other people.
struct Notes {
  std::string description{};  ///< may have several lines
  std::string unit{};         ///< of a number: "km/h"
  /// Annotations of FIDL ("@deprecated", "@author" …) and others by name, without the description. Without
  /// "@": keys of a FDEPL file that the model has no place for ("ErrorType", "Domain" …), with the value as
  /// written there.
  std::map<std::string, std::string, std::less<>> others{};
  friend bool operator==(const Notes&, const Notes&) = default;
};

/// Index of Model::types.
enum class TypeIndex : std::uint32_t {};
inline constexpr TypeIndex no_type{0xffff'ffff};

/// What a type is made of.
enum class Kind : std::uint8_t {
  primitive,    ///< Type::primitive: boolean, integer, floating point number
  string,       ///< characters
  bytes,        ///< a byte buffer
  array,        ///< of Type::element
  structure,    ///< Type::members, those of Type::base first
  choice,       ///< one of Type::members, announced by its selector: union, variant
  enumeration,  ///< Type::enumerators, carried as Type::primitive
  map,          ///< of Type::key to Type::element
  alias,        ///< another name for Type::element: typedef
};

/// The kind's name in the JSON of a model: "structure".
[[nodiscard]] const char* to_string(Kind kind) noexcept;

/// How one use of a type is laid out on the wire: of its own bytes, not of what is nested in them, which has
/// rules of its own. These are effective values: a reader has applied all defaults of its source already.
/// What the kind of the type does not need is left as it is.
struct Wire {
  /// Before an array, map, string or byte buffer, a structure, or a choice. The default is that of the kind:
  /// default_wire().
  someip::FieldWidth length = someip::FieldWidth::none;
  someip::FieldWidth selector = someip::FieldWidth::bits32;  ///< of a choice
  bool length_first = true;                                  ///< of a choice: length, selector, data
  someip::StringEncoding encoding = someip::StringEncoding::utf8;
  bool bom = true;         ///< of a string
  bool terminator = true;  ///< of a string
  /// A string without length field: its bytes, BOM and terminator included. A choice without length field:
  /// the bytes of its data and padding; 0: no padding. Else 0.
  std::uint32_t fixed_bytes = 0;
  /// Of an integer or enumeration in a packed row of bits; 0: whole bytes.
  std::uint8_t bits = 0;
  /// Of the numbers in it, those of arrays and nested types included, unless these say otherwise; nothing: as
  /// what holds it.
  std::optional<std::endian> byte_order{};
  friend bool operator==(const Wire&, const Wire&) = default;
};

/// The rules of the specification, which are also CommonAPI's (version 2 of its deployment): length fields of
/// 32 bits before all but structures, strings in UTF-8 with BOM and terminator.
[[nodiscard]] Wire default_wire(Kind kind) noexcept;

/// A use of a type under a name: a member of a structure or choice, an argument, an element of an array.
struct Value {
  std::string name{};  ///< empty: the element, key or target of a type
  TypeIndex type = no_type;
  Wire wire{};
  std::optional<someip::DataId> tag{};  ///< "TLV"
  bool optional = false;                ///< may be missing; only with a tag
  std::string default_value{};          ///< as in a `.msg` file; empty: none; never on the wire
  Notes notes{};
  Place place{};
};

/// A named value of an enumeration.
struct Enumerator {
  std::string name;
  std::int64_t value = 0;  ///< of an uint64 enumeration the same 64 bits
  Notes notes{};
  Place place{};
};

/// A named value that never is on the wire.
struct Constant {
  std::string name;
  TypeIndex type = no_type;
  std::string value;    ///< as in a `.msg` file: a number, true, "text" with quotes; compound ones as JSON
  std::string scope{};  ///< as Type::scope
  Notes notes{};
  Place place{};
};

/// Where types and constants stand together: a type collection of FIDL that says something of itself.
struct TypeCollection {
  std::string scope{};  ///< as Type::scope
  std::uint32_t major = 1;
  std::uint32_t minor = 0;
  Notes notes{};
  Place place{};
};

/// A type. Types that are alike but for their wire rules are variants of one: they have its name, and writers
/// that have rules for each use write them as such.
struct Type {
  Kind kind = Kind::primitive;
  /// "CurveProfile"; empty: a type without a name, as that of `UInt8[]`.
  std::string name{};
  /// Where the name is unique: "org.example.Types", "/DataTypes/Body", or the package of a ROS type,
  /// "sensor_msgs".
  std::string scope{};
  std::string ros_name{};  ///< "pkg/msg/Type", if it was read from, or is fixed to be, a ROS type
  TypeIndex variant_of = no_type;
  /// Of a primitive, and of an enumeration as it is on the wire. `string`, `wstring`: not here.
  messages::Primitive primitive = messages::Primitive::uint8;
  /// Enumerations: what an application uses, where that differs from the wire.
  std::optional<messages::Primitive> backing{};
  std::optional<std::int64_t> invalid_value{};  ///< of an integer or enumeration: "there is no value"
  std::optional<std::int64_t> minimum{};  ///< of an integer: `Integer(min, max)`, COMPU-METHOD, constraints
  std::optional<std::int64_t> maximum{};
  Wire wire{};                             ///< as declared with the type; each use has its own
  std::vector<Value> members{};            ///< structure, choice: its own ones
  std::vector<std::uint32_t> selectors{};  ///< choice: of each member; empty: 1, 2, 3 …
  TypeIndex base = no_type;                ///< structure, choice, enumeration: what it extends
  bool polymorphic = false;  ///< structure: FIDL's; not carried by anything, refused where it is used
  std::vector<Enumerator> enumerators{};  ///< its own ones
  Value element{};                        ///< array, map, alias
  Value key{};                            ///< map
  /// Array, map, byte buffer: elements; string: characters.
  std::uint32_t min_size = 0;
  std::uint32_t max_size = 0;  ///< 0: no limit
  bool fixed_size = false;     ///< always max_size elements
  Notes notes{};
  Place place{};
};

/// Segmentation and collection of one kind of message.
struct Transfer {
  Transport transport = Transport::udp;
  /// SOME/IP-TP: payload bytes of a segment, without the 8 + 4 + 8 bytes of headers; 0: as the stack does.
  std::uint32_t segment_bytes = 0;
  std::chrono::microseconds separation{0};  ///< between segments
  std::chrono::microseconds debounce{0};    ///< nPDU: the least time between two that are collected
  std::chrono::microseconds retention{0};   ///< nPDU: how long one may wait for others
  // Where a source says these. Nothing: none does, and the value is what its language has by default. That
  // does not count when two are compared.
  std::optional<Place> transport_at{};
  std::optional<Place> segment_bytes_at{};
  std::optional<Place> retention_at{};
  friend bool operator==(const Transfer& one, const Transfer& other) noexcept {
    return one.transport == other.transport && one.segment_bytes == other.segment_bytes &&
           one.separation == other.separation && one.debounce == other.debounce &&
           one.retention == other.retention;
  }
};

/// End-to-end protection by the names and units of docs/configuration.md ("e2e"): profile "4", keys
/// "data_id", "offset_bits" …
struct Protection {
  std::string profile{};  ///< "1", "2", "4" … "44", "4m"; empty: none
  std::map<std::string, std::uint64_t, std::less<>> numbers{};
  std::map<std::string, std::string, std::less<>> words{};
  /// Instances of the service that have another one, which is here in full; in these it is empty.
  std::map<someip::InstanceId, Protection> of_instances{};

  /// Nobody has any.
  [[nodiscard]] bool empty() const noexcept { return profile.empty() && of_instances.empty(); }
  /// That of one instance; nothing, or any: that of those which are not in `of_instances`.
  [[nodiscard]] const Protection& of(std::optional<someip::InstanceId> instance) const;
  /// Notes what an instance has, if that is another one. It has none of instances of its own.
  void set(someip::InstanceId instance, const Protection& its);
  friend bool operator==(const Protection&, const Protection&) = default;
};

/// What holds for a whole payload.
struct Payload {
  std::vector<Value> values{};  ///< in the order of the wire
  /// False: nobody said what is in it, as vsomeip JSON and captures do not. Otherwise no values are no bytes.
  bool known = true;
  std::endian byte_order = std::endian::big;
  bool length_fields_always_big = false;  ///< else they follow the byte order, as with CommonAPI
  std::uint8_t alignment = 1;             ///< bytes
  /// Before tagged members; see someip::PayloadRules.
  someip::FieldWidth tagged_length = someip::FieldWidth::bits32;
  bool smallest_tagged_length = false;
  std::uint8_t crc_bytes = 0;  ///< CommonAPI's SomeIp…CRCWidth
};

/// An event: CommonAPI's broadcast.
struct Event {
  std::string name;
  std::optional<someip::MethodId> id{};
  Payload payload{};
  std::vector<someip::EventgroupId> eventgroups{};
  Transfer transfer{};
  bool selective = false;
  std::string selector{};  ///< FIDL: name:selector
  std::optional<std::chrono::microseconds> cycle{};
  std::optional<std::uint32_t> observed_bytes{};  ///< of a capture: the largest payload seen
  Protection e2e{};
  /// What it is called in ROS 2, "/points", where that is fixed: services that were made of ROS types have
  /// it.
  std::string ros_name{};
  Notes notes{};
  Place place{};
  Place id_place{};
};

struct Method {
  std::string name;
  std::optional<someip::MethodId> id{};
  Payload request{};
  Payload response{};
  std::vector<std::string> inout{};  ///< names of arguments that are in both
  bool fire_and_forget = false;
  /// FIDL's error enumeration: the first value of the response, which is not in response.values. Its wire is
  /// that of the enumeration.
  TypeIndex error = no_type;
  std::vector<std::string> application_errors{};  ///< AUTOSAR: POSSIBLE-AP-ERROR-REFS
  std::string selector{};
  Transfer request_transfer{};
  Transfer response_transfer{};
  std::optional<std::chrono::milliseconds> timeout{};
  std::optional<std::uint32_t> observed_bytes{};
  Protection e2e{};
  std::string ros_name{};  ///< as Event::ros_name
  /// "std_srvs/srv/Empty", if it was read from a ROS service without arguments and answers: no type tells.
  std::string ros_type{};
  Notes notes{};
  Place place{};
  Place id_place{};
};

/// A field: CommonAPI's attribute. Each of its three parts is there or not.
struct Field {
  std::string name;
  Payload payload{};  ///< one value
  std::optional<someip::MethodId> getter{};
  std::optional<someip::MethodId> setter{};
  std::optional<someip::MethodId> notifier{};
  bool has_getter = true;  ///< also where no id is known yet
  bool has_setter = true;
  bool has_notifier = true;
  std::vector<someip::EventgroupId> eventgroups{};
  Transfer getter_transfer{};
  Transfer setter_transfer{};
  Transfer notifier_transfer{};
  std::optional<std::chrono::microseconds> cycle{};  ///< of the notifier
  std::optional<std::uint32_t> observed_bytes{};
  Protection e2e{};  ///< of the notifier
  Protection getter_e2e{};
  Protection setter_e2e{};
  std::string ros_name{};  ///< as Event::ros_name
  Notes notes{};
  Place place{};
  Place getter_place{};  ///< of the ids
  Place setter_place{};
  Place notifier_place{};
};

struct Eventgroup {
  std::string name{};
  someip::EventgroupId id{};
  bool id_is_chosen = false;  ///< nobody gave it: allocate_ids() chose it
  Place place{};
};

/// A service interface and how SOME/IP carries it.
struct Service {
  std::string name;
  std::string scope{};  ///< "org.example", "/Services"
  std::optional<someip::ServiceId> id{};
  std::uint8_t major = 1;
  std::uint32_t minor = 0;
  bool has_version = false;  ///< the source says which
  std::vector<Event> events{};
  std::vector<Method> methods{};
  std::vector<Field> fields{};
  std::vector<Eventgroup> eventgroups{};  ///< sorted by id
  std::string base{};                     ///< FIDL: the interface that it extends; its members are copied in
  std::vector<std::string> manages{};
  std::vector<std::string> namespaces{};    ///< AUTOSAR
  bool from_ros = false;                    ///< ROS nodes have what it is made of: a bridge offers it
  bool id_is_chosen = false;                ///< nobody gave it: allocate_ids() chose it
  std::set<someip::MethodId> chosen_ids{};  ///< the same of its methods, events and parts of fields
  Notes notes{};
  Place place{};
  Place id_place{};
};

/// Where an eventgroup of an instance is sent to many at once.
struct Multicast {
  someip::EventgroupId eventgroup{};
  Endpoint group{};
  std::uint32_t threshold = 0;  ///< from how many subscribers on; 0: never, 1: always
  // Where a source says this, and the threshold; as Transfer::transport_at.
  std::optional<Place> group_at{};
  std::optional<Place> threshold_at{};
  bool has_usual_port = false;  ///< nobody says the port of the group: it is that of the instance
  friend bool operator==(const Multicast& one, const Multicast& other) noexcept {
    return one.eventgroup == other.eventgroup && one.group == other.group && one.threshold == other.threshold;
  }
};

/// An instance of a service that somebody offers or wants.
struct Instance {
  enum class Role : std::uint8_t { provided, required };
  Role role = Role::provided;
  std::string name{};  ///< CommonAPI: its InstanceId; AUTOSAR: SHORT-NAME
  std::string
      service{};  ///< "scope.name" of a Service (AUTOSAR: its path); or empty, when only ids are known
  std::optional<someip::ServiceId> service_id{};
  std::optional<someip::InstanceId> id{};  ///< nothing: any
  bool id_is_chosen = false;               ///< nobody gave it: allocate_ids() chose it
  std::optional<std::uint8_t> major{};     ///< nothing: that of the service
  std::optional<std::uint32_t> minor{};    ///< required: nothing: any
  std::optional<IpAddress> address{};
  std::optional<std::uint16_t> udp_port{};
  std::optional<std::uint16_t> tcp_port{};
  std::vector<Multicast> multicast{};
  std::vector<someip::EventgroupId> eventgroups{};  ///< required: those that are subscribed to; empty: all
  std::optional<sd::Timing> timing{};
  std::optional<std::uint32_t> observed_ttl_s{};  ///< of a capture: of its last offer
  std::optional<Duration> observed_cycle{};       ///< of a capture: between its last two offers to all
  std::optional<std::uint16_t> priority{};        ///< load balancing
  std::optional<std::uint16_t> weight{};
  /// The items of its configuration option; AUTOSAR calls them CAPABILITY-RECORDS.
  std::map<std::string, std::string, std::less<>> configuration{};
  std::string machine{};  ///< name of a Machine; empty: not known
  Notes notes{};
  Place place{};
  /// Where a source says a setting, by its name in the JSON of a model: "udp_port", "ttl". Of a time that is
  /// not here nobody said anything: it is the default of a language. Other settings are said at `place`.
  std::map<std::string_view, Place> said_at{};
};

/// A host.
struct Machine {
  std::string name{};
  std::optional<IpAddress> address{};
  std::optional<IpAddress> sd_multicast{};
  std::optional<std::uint16_t> sd_port{};
  Place place{};
};

/// What a capture shows of a client: what it subscribes to.
struct ObservedUse {
  IpAddress client{};
  someip::ServiceId service{};
  someip::InstanceId instance{};
  std::uint8_t major = 1;
  someip::EventgroupId eventgroup{};
  bool udp = false;        ///< the client named an endpoint for it
  bool tcp = false;        ///< likewise
  bool multicast = false;  ///< the server named a group
};

/// A system's interfaces.
struct Model {
  std::vector<std::string> files{};          ///< that it was read from, as they were named
  std::set<std::uint32_t> configurations{};  ///< which of them are configurations of vsomeip
  std::vector<Type> types{};
  std::vector<Service> services{};
  std::vector<Instance> instances{};
  std::vector<Machine> machines{};
  std::vector<ObservedUse> observed_uses{};
  std::vector<Constant> constants{};
  /// At most one of each scope: those with a description, or another version than 1.0.
  std::vector<TypeCollection> collections{};

  [[nodiscard]] const Type& at(TypeIndex index) const { return types[static_cast<std::size_t>(index)]; }
  [[nodiscard]] Type& at(TypeIndex index) { return types[static_cast<std::size_t>(index)]; }
  TypeIndex add(Type type) {
    types.push_back(std::move(type));
    return TypeIndex{static_cast<std::uint32_t>(types.size() - 1)};
  }
  [[nodiscard]] const Service* service(std::string_view full_name) const;
};

/// "scope.name", or "scope/name" where the scope is an AUTOSAR path; the name alone without a scope.
[[nodiscard]] std::string full_name(std::string_view scope, std::string_view name);

/// Whether a reader made the service's name of its id, "service_1234", because the source has no names.
[[nodiscard]] bool has_made_name(const Service& service);

/// Where an id stands: `of_id`, or where its element does.
[[nodiscard]] inline const Place& place_of_id(const Place& of_id, const Place& element) noexcept {
  return of_id.mark.line == 0 ? element : of_id;
}

/// Whether an instance is one of a service: by the name that it gives, or else by the id.
[[nodiscard]] bool is_of(const Instance& instance, const Service& service);

/// What to call an instance in a message: its name, or "car.Door 0x0001".
[[nodiscard]] std::string label_of(const Instance& instance);

/// Enumerations without a name that methods have as their errors: "car.Door.open.error", what to call them in
/// a message.
[[nodiscard]] std::map<TypeIndex, std::string> names_of_errors(const Model& model);

/// How many types may be in each other, and extend each other. join() refuses models with more; until then,
/// the functions below look no further.
inline constexpr std::size_t max_type_nesting = 200;

/// Behind all aliases: the type that is on the wire. An alias, if there is none: of aliases that go round, or
/// of no type.
[[nodiscard]] const Type& resolved(const Model& model, TypeIndex type);
/// The index of that type; `type` itself if there is none.
[[nodiscard]] TypeIndex behind_aliases(const Model& model, TypeIndex type);

/// Of a structure, choice or enumeration with bases: those of the base first. They terminate also for bases
/// that go round.
[[nodiscard]] std::vector<Value> all_members(const Model& model, const Type& type);
[[nodiscard]] std::vector<Enumerator> all_enumerators(const Model& model, const Type& type);

/// What a reader made of its input, or what a writer could not carry.
struct Reading {
  Model model{};
  std::vector<documents::Problem> problems{};  ///< in the order of the files
  [[nodiscard]] bool ok() const noexcept;      ///< no problem is an error
};

/// Adds all of `from` to `to`; indices of types and files stay right. Elements of one name are both there
/// after it.
void append(Model& to, Model from);

/// Something that a target has no form for. Never dropped silently: `trestle generate` prints them.
struct NotCarried {
  std::string element;  ///< "Door.open": service and member, or a type
  std::string what;     ///< "selective", "SomeIpMethodErrorCoding"
  Place place{};
};

}  // namespace trestle::describe
