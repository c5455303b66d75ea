#pragma once
#include <optional>
#include <string>
#include <tl/expected.hpp>

#include "bridge/messages/convert/conversion_plan.hpp"
#include "bridge/messages/types/field_service.hpp"
#include "bridge/messages/types/type_library.hpp"

namespace trestle::messages {

/// The conversion of a request or response. One without fields has no payload on the SOME/IP side, where
/// rosidl gives it one byte; what comes there is not looked at.
class CallMessagePlan {
 public:
  CallMessagePlan(ConversionPlan plan, bool is_empty) : plan_{std::move(plan)}, is_empty_{is_empty} {}

  /// As those of ConversionPlan.
  [[nodiscard]] tl::expected<Gathered, ConversionError> cdr_to_someip(ByteView sample,
                                                                      ConversionScratch& scratch) const;
  [[nodiscard]] tl::expected<Gathered, ConversionError> someip_to_cdr(ByteView payload,
                                                                      ConversionScratch& scratch) const;
  /// Of its SOME/IP payload, as most_someip_bytes().
  [[nodiscard]] std::optional<std::size_t> most_bytes() const;

 private:
  ConversionPlan plan_;
  bool is_empty_;
};

/// Both messages of a service.
struct ServicePlans {
  CallMessagePlan request;
  CallMessagePlan response;
};

/// @param rules  of both messages; rules of single types may name types of either.
/// @return the plans, or one line that says why the service cannot be carried under these rules.
[[nodiscard]] tl::expected<ServicePlans, std::string> compile_service(const ServiceTypes& types,
                                                                      const MessageRules& rules);

/// For a service that gets or sets a field. On the SOME/IP side there is only the value, without the message
/// of the service around it; an empty message is nothing there.
/// @param rules  of the value.
/// @return as above.
[[nodiscard]] tl::expected<ServicePlans, std::string> compile_field_service(const FieldServiceTypes& types,
                                                                            FieldAccess access,
                                                                            const MessageRules& rules);

/// The rules that concern the types in this tree.
[[nodiscard]] MessageRules rules_for(const TypeTree& tree, const MessageRules& rules);

}  // namespace trestle::messages
