// Property: a CDR sample that is accepted converts back, and what comes back converts to the same payload;
// referencing or copying makes no difference, nor do the messages before or the quick ways; an error lies
// within the input.
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
                      messages::ConversionScratch& scratch) { return plan.cdr_to_someip(message, scratch); });
  static messages::ConversionScratch scratch;
  const auto payload = plans->referencing.cdr_to_someip(input, scratch);
  messages::ConversionScratch fresh;
  require(plans->referencing.cdr_to_someip(input, fresh).has_value() == payload.has_value());
  if (!payload) {
    require(payload.error().offset <= input.size() + 7);  // padding in front of the item may be missing too
    require(!plans->copying.cdr_to_someip(input, scratch));
    return 0;
  }
  const auto first = whole(*payload);
  require(whole(plans->referencing.cdr_to_someip(input, fresh).value()) == first);
  require(whole(plans->copying.cdr_to_someip(input, scratch).value()) == first);
  const auto cdr = whole(plans->referencing.someip_to_cdr(first, scratch).value());
  require(whole(plans->copying.someip_to_cdr(first, scratch).value()) == cdr);
  require(whole(plans->referencing.cdr_to_someip(cdr, scratch).value()) == first);
  return 0;
}
