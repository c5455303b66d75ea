#pragma once
#include <algorithm>
#include <span>
#include <string>
#include <string_view>

#include "bridge/conform/catalogue_ids.hpp"

/// What a case can be about: the requirements of the Open SOME/IP Specification and the cases of OPEN
/// Alliance TC8, each in our own words. The tables are bridge/conform/catalogue/*.csv.
namespace trestle::conform {

/// The id of a requirement, "feat_req_someipsd_26". One that is not in the catalogue does not compile.
class RequirementId {
 public:
  consteval RequirementId(const char* id) : text_{id} {  // NOLINT(google-explicit-constructor): lists of ids
    if (!std::ranges::binary_search(requirement_ids, text_)) {
      throw "there is no such requirement in bridge/conform/catalogue/requirements.csv";
    }
  }
  [[nodiscard]] constexpr std::string_view text() const noexcept { return text_; }

 private:
  std::string_view text_;
};

/// The id of a TC8 case, "SOMEIPSRV_FORMAT_01". One that is not in the catalogue does not compile.
class Tc8Id {
 public:
  consteval Tc8Id(const char* id) : text_{id} {  // NOLINT(google-explicit-constructor): lists of ids
    if (!std::ranges::binary_search(tc8_ids, text_)) {
      throw "there is no such case in bridge/conform/catalogue/tc8.csv";
    }
  }
  [[nodiscard]] constexpr std::string_view text() const noexcept { return text_; }

 private:
  std::string_view text_;
};

struct RequirementRow {
  std::string id;
  std::string area;
  std::string kind;
  std::string testable;  ///< "yes", "pcap" (a capture is enough) or "no"
  std::string summary;
  /// Of one that is testable by "pcap": why no rule of bridge/conform/replay is about it; empty: there is
  /// one.
  std::string why_no_rule{};
  /// Of one that is testable by "yes": why neither a case of bridge/conform/cases nor a rule is about it;
  /// empty: one is.
  std::string why_no_case{};
};
[[nodiscard]] std::span<const RequirementRow> requirements();
/// Null: there is none of this id.
[[nodiscard]] const RequirementRow* find_requirement(std::string_view id);

struct Tc8Row {
  std::string id;
  std::string title;
  std::string stimulus;  ///< what the tester sends
  std::string expected;  ///< what the device has to do
  /// Why no case of bridge/conform/cases is about it; empty: there is one.
  std::string why_no_case;
};
[[nodiscard]] std::span<const Tc8Row> tc8_cases();
/// Null: there is none of this id.
[[nodiscard]] const Tc8Row* find_tc8(std::string_view id);

/// The tables as they stand in the files.
[[nodiscard]] std::string_view requirements_csv();
[[nodiscard]] std::string_view no_rule_csv();
[[nodiscard]] std::string_view no_case_csv();
[[nodiscard]] std::string_view tc8_csv();

}  // namespace trestle::conform
