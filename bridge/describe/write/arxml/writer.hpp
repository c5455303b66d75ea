#pragma once
#include <chrono>
#include <compare>
#include <cstddef>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <vector>

#include "bridge/describe/write/arxml/write_arxml.hpp"
#include "bridge/describe/write/arxml/xml.hpp"
#include "bridge/describe/write/written.hpp"

namespace trestle::describe::arxml_writer {

/// What is not the model's own stands in packages of this one.
inline constexpr std::string_view own = "/Trestle";

/// Elements with rules of their own that a file has, each counted with all that it is in, which AUTOSAR
/// names; and what is looked at to find them: of one payload, of all. A structure of two structures of two
/// structures … has twice as many elements at each level.
inline constexpr std::size_t max_special_rules = 200'000;
inline constexpr std::size_t max_rule_steps = 1'000'000;
inline constexpr std::size_t max_rule_steps_of_all = 20'000'000;

/// Protections of elements that a file has: each instance has those of its service.
inline constexpr std::size_t max_protections = 200'000;

/// Transformation properties: only what is said.
struct Rules {
  std::optional<std::uint8_t> array{};
  std::optional<std::uint8_t> string{};
  std::optional<std::uint8_t> structure{};
  std::optional<std::uint8_t> choice{};
  std::optional<std::uint8_t> selector{};
  std::optional<someip::StringEncoding> encoding{};
  std::optional<bool> legacy{};
  std::optional<std::endian> byte_order{};
  std::optional<std::uint8_t> alignment_bytes{};
  std::optional<bool> smallest{};
  friend auto operator<=>(const Rules&, const Rules&) = default;
};

/// Seconds, as all times of AUTOSAR are, without trailing zeros: "0.002".
[[nodiscard]] std::string seconds(std::chrono::nanoseconds time);

/// Before an id.
inline void note_chosen(Xml& id, bool is_chosen) {
  if (is_chosen) {
    id.comment(chosen_id_note);
  }
}

/// Short names of which each is given once.
class Names {
 public:
  /// The name, or the first of name_2, name_3 … that is not taken.
  std::string take(const std::string& name);
  void insert(const std::string& name) { taken_.insert(name); }

 private:
  std::set<std::string> taken_;
  std::map<std::string, unsigned> next_;  ///< by name: numbers below stand behind it already
};

class Writer {
 public:
  explicit Writer(const Model& model) : model_{model}, error_names_{names_of_errors(model)} {}
  [[nodiscard]] ArxmlFile write();

 private:
  /// A value that has a place in the file: an event, field, argument or member.
  struct Prototype {
    std::string path{};
    std::string dest{};
  };
  /// Other rules for one prototype.
  struct Special {
    std::vector<Prototype> way{};  ///< from the payload's own value to the one meant
    Rules rules{};
    /// Of what is in it, without members of structures and choices, which have rules of their own: which keys
    /// have been met, and which length fields its arrays have.
    std::set<std::string_view> met{};
    std::set<std::uint8_t> arrays{};
  };
  /// What a payload needs.
  struct Needs {
    Rules base{};
    std::map<std::string, bool> decided{};
    std::vector<Special> special{};
    bool has_tags = false;
    bool has_tagged_lengths = false;                    ///< of them, some have length fields
    bool says_tagged_length = false;                    ///< and a rule of theirs tells readers which
    std::optional<someip::FieldWidth> tagged_length{};  ///< before all of these; nothing: the tags tell
    /// Structures and choices in which nothing needs rules of its own, as far as rules are decided: they need
    /// not be looked at again, however often they are used.
    std::set<const Type*> plain{};
    std::set<const Type*> open{};  ///< that are being looked at
    std::size_t steps = 0;
    const char* cut = nullptr;  ///< what was left out
  };

  /// An element with E2E protection.
  struct Protected {
    const Protection* e2e = nullptr;
    bool is_event = false;  ///< else a method, a getter or a setter
    std::string path{};     ///< of its deployment
    std::string name{};
    std::string element{};  ///< what it is called in a message
    Place place{};
    /// What has been written of it: by what instances have of `e2e`. Empty text: nothing can be.
    std::map<const Protection*, std::string> texts{};
    std::set<std::string> told{};  ///< what of it is lost
  };

  // types.cpp
  void write_types();
  /// Tells apart variants that differ in what AUTOSAR's types say; the others are one type of AUTOSAR.
  void group_variants();
  void write_type(TypeIndex index, std::uint32_t size, const std::string& path);
  void write_enumeration(const Type& type, const std::string& package, const std::string& name);
  [[nodiscard]] TypeIndex representative(TypeIndex index) const {
    return representatives_[static_cast<std::size_t>(index)];
  }
  /// The type of a use. Strings of different sizes have different types.
  [[nodiscard]] const std::string& path_of(const Value& use);
  [[nodiscard]] const std::string& path_of(TypeIndex wanted, std::uint32_t size);
  [[nodiscard]] std::uint32_t text_size(const Value& use) const;
  [[nodiscard]] std::string base_type(messages::Primitive primitive);
  [[nodiscard]] std::string primitive_path(messages::Primitive primitive);
  void write_members(Xml& xml, const std::vector<Value>& members, const std::string& type_path);
  void number_properties(Xml& xml, const Type& number, const std::string& name, const std::string& compu);
  [[nodiscard]] std::string package_of(std::string_view scope) const;

  // wire.cpp
  void need(const Value& value, Needs& needs, std::vector<Prototype>& way, int depth);
  void need_inside(const Value& value, Needs& needs, std::vector<Prototype>& way, Special& special,
                   int depth);
  void lost_inside(Needs& needs, const std::string& element, std::string what, Place place);
  [[nodiscard]] std::optional<someip::FieldWidth> tagged_length(const Value& value, Needs& needs) const;
  void need_members(const Value& value, const Type& type, Needs& needs, std::vector<Prototype>& way,
                    int depth);
  void write_wire(const Service& service, const std::string& service_path, const std::string& element,
                  std::string_view list, std::string_view reference, std::string_view dest,
                  const std::vector<std::pair<Prototype, const Value*>>& values, const Payload& payload);
  [[nodiscard]] std::string rules_path(const Rules& rules);
  void write_rules();
  void write_tag(std::optional<someip::DataId> tag, std::string_view reference, std::string_view dest,
                 const std::string& path);
  void write_tags();

  // services.cpp
  void write_service(const Service& service);
  void write_deployment(const Service& service, const std::string& service_path);
  [[nodiscard]] std::string write_event(Xml& xml, const Service& service, const Event& event,
                                        const std::string& service_path, const std::string& name);
  void write_method(Xml& xml, const Service& service, const Method& method, const std::string& service_path,
                    const std::string& name);
  void write_transfer(Xml& xml, const Transfer& transfer, const std::string& element, const Place& place);
  void collecting_times(const Transfer& transfer, const std::string& element, const Place& place);
  void write_application_error(const std::string& path);
  void check_payload(const std::string& element, const Payload& payload, Place place);

  // instances.cpp
  void write_instances();
  [[nodiscard]] std::string timing_path(const sd::Timing& timing, bool server, const std::string& name,
                                        Place place);

  // protection.cpp
  void note_protections(const Service& service, const std::string& deployment);
  void write_protections(Xml& xml, const Instance& instance);
  [[nodiscard]] const std::string& protection_text(Protected& one, const Protection& e2e);
  [[nodiscard]] std::string protection_of(Protected& one, const Protection& e2e);
  [[nodiscard]] std::string profile_path(std::map<std::string, std::string>& texts);
  void write_profiles();
  void list_unwritten_protections();

  void notes(Xml& xml, const Notes& notes, std::string_view category = {});
  /// What to call a type in a message.
  [[nodiscard]] std::string label(const Type& type) const;
  void lose_units_in(const Type& type, const std::string& called);
  void lost(std::string element, std::string what, Place place = {}) {
    file_.not_carried.push_back({std::move(element), std::move(what), place});
  }

  const Model& model_;
  std::map<TypeIndex, std::string> error_names_;
  ArxmlFile file_{};
  Packages packages_{};
  std::vector<TypeIndex> representatives_{};                                 ///< of each type
  std::map<std::pair<TypeIndex, std::uint32_t>, std::string> type_paths_{};  ///< by type and size of its text
  std::map<std::pair<std::string, std::string>, std::string> members_{};  ///< short name by type and member
  std::set<std::string> services_with_instances_{};                       ///< full names
  std::vector<std::pair<Rules, std::string>> rules_{};
  std::map<Rules, std::string> rule_names_{};
  std::vector<std::string> tags_{};  ///< TLV-DATA-ID-DEFINITIONs
  std::map<std::string, std::string> tagged_{};
  std::map<std::string, std::vector<Protected>> protected_{};  ///< by full name of the service
  std::map<std::string, std::string> profile_names_{};         ///< by what stands in them
  std::size_t protection_count_ = 0;
  std::set<std::string> service_paths_{};
  std::map<const Service*, std::string> service_names_{};
  std::map<std::string, std::string> deployments_{};                            ///< by service
  std::map<std::pair<std::string, std::uint16_t>, std::string> eventgroups_{};  ///< path by service and id
  /// Of each service: to short names.
  std::map<std::string, std::map<std::string, std::string>> member_names_{};
  std::optional<Prototype> root_{};  ///< of an event whose arguments are members of a structure
  bool has_usual_times_ = false;     ///< of the service that is deployed: usual_collecting
  std::uint32_t errors_ = 0;
  std::size_t special_count_ = 0;
  std::size_t rule_steps_ = 0;
};

}  // namespace trestle::describe::arxml_writer
