#pragma once
#include <string>

#include "bridge/messages/convert/first_complaint.hpp"
#include "bridge/messages/convert/message_rules.hpp"
#include "bridge/messages/types/type_library.hpp"

namespace trestle::messages {

/// Finds rules that are mistakes: about types or fields that do not exist, or about what these do not have.
class RuleCheck {
 public:
  RuleCheck(const TypeTree& tree, const MessageRules& rules, FirstComplaint& complain)
      : tree_{tree}, rules_{rules}, complain_{complain} {}

  /// Rules for types or fields that do not exist are mistakes.
  void check_types();
  /// Rules that no field asks for are mistakes, too.
  void check_variants();
  /// Rules of a single field that are about something which it does not have.
  void check_use(const FieldType& type, const FieldRules& use, const std::string& path, bool is_tagged);

  /// The rules of a message, as a field uses it. Complains where that takes rules that are not the message's.
  /// @param use  of the message; null: there are no rules for it.
  [[nodiscard]] const TypeRules* rules_of(const MessageDefinition& definition, const FieldRules* use);

 private:
  void check_itself(const TypeRules& own, const std::string& name);
  void check_frame(const FieldRules& rules, TypeRules::Form form, const std::string& what);

  const TypeTree& tree_;
  const MessageRules& rules_;
  FirstComplaint& complain_;
};

}  // namespace trestle::messages
