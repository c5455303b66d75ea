#pragma once
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "bridge/describe/model.hpp"

namespace trestle::describe {

/// What somebody wants in place of what the sources say of a method, an event or a field. Nothing: as they
/// say.
struct MemberEdit {
  std::optional<std::string> name{};
  std::optional<std::uint16_t> id{};      ///< of a method or event
  std::optional<std::uint16_t> getter{};  ///< this and the next two: of a field
  std::optional<std::uint16_t> setter{};
  std::optional<std::uint16_t> notifier{};
  std::optional<Transport> transport{};  ///< of request and response; of all parts of a field
  std::optional<std::vector<someip::EventgroupId>> eventgroups{};  ///< of an event or field
  friend bool operator==(const MemberEdit&, const MemberEdit&) = default;
};

struct ServiceEdit {
  std::optional<std::string> name{};  ///< without its scope
  std::optional<std::uint16_t> id{};
  std::optional<std::uint8_t> major{};
  std::optional<std::uint32_t> minor{};
  /// Of the first instance; without any one is made.
  std::optional<std::uint16_t> instance{};
  std::optional<std::uint16_t> udp_port{};
  std::optional<std::uint16_t> tcp_port{};
  using Members = std::map<std::string, MemberEdit, std::less<>>;
  Members methods{};  ///< by member_key()
  Members events{};   ///< by member_key()
  Members fields{};   ///< by name
  friend bool operator==(const ServiceEdit&, const ServiceEdit&) = default;
};
/// By the full name of the service in the sources.
using Edits = std::map<std::string, ServiceEdit, std::less<>>;

/// What edits made.
struct Edited {
  /// What has another name now, and what it is in the edits: "car.Gate" -> "car.Door",
  /// "car.Gate methods turn" -> "open"; the words as in the JSON of a model.
  std::map<std::string, std::string> renamed{};
  std::vector<documents::Problem> problems{};  ///< names that another element has: these are not taken
};

/// Edits a model. What has no such name there is left alone.
[[nodiscard]] Edited apply_edits(const Edits& edits, Model& model);

}  // namespace trestle::describe
