// Property: a SOME/IP payload that is accepted converts back (but for what its length fields cannot say when
// the padding or the defaults are there that were missing, and for unions that were missing), and what comes
// back converts to the same CDR; referencing or copying makes no difference, nor do the messages before or
// the quick ways; an error lies within the input.
#include "fuzz/conversion_plans.hpp"

using namespace trestle;
using namespace trestle::fuzz;

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  ByteView input = std::as_bytes(std::span{data, size});
  const Plans* const plans = choose(input);
  if (plans == nullptr) {
    return 0;
  }
  require_the_same(*plans, input,
                   [](const messages::ConversionPlan& plan, ByteView message,
                      messages::ConversionScratch& scratch) { return plan.someip_to_cdr(message, scratch); });
  static messages::ConversionScratch scratch;
  const auto cdr = plans->referencing.someip_to_cdr(input, scratch);
  messages::ConversionScratch fresh;
  require(plans->referencing.someip_to_cdr(input, fresh).has_value() == cdr.has_value());
  if (!cdr) {
    require(cdr.error().offset <= input.size());
    require(!plans->copying.someip_to_cdr(input, scratch));
    return 0;
  }
  const auto first = whole(*cdr);
  require(whole(plans->referencing.someip_to_cdr(input, fresh).value()) == first);
  require(whole(plans->copying.someip_to_cdr(input, scratch).value()) == first);
  const auto payload = plans->copying.cdr_to_someip(first, scratch);
  if (!payload) {
    const auto fault = payload.error().fault;
    require(fault == messages::ConversionFault::length_overflow ||
            (fault == messages::ConversionFault::bad_union && plans->has_type_rules));
    require(plans->copying.program().rules.alignment > 1 || plans->has_type_rules);
    return 0;
  }
  const auto again = whole(*payload);
  require(whole(plans->referencing.someip_to_cdr(again, scratch).value()) == first);
  return 0;
}
