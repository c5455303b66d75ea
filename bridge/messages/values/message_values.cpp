#include "bridge/messages/values/message_values.hpp"

#include <fmt/format.h>

#include "bridge/messages/values/printers.hpp"
#include "bridge/messages/values/sample_builder.hpp"

namespace trestle::messages {
namespace {

template <typename Printer>
tl::expected<std::string, std::string> print_with(ByteView sample, const TypeTree& tree,
                                                  const PrintOptions& options, const Words* words) {
  Printer printer{options.bytes};
  const WalkOptions walk{
      .bytes_as_one = options.bytes != BytesForm::list, .longest = options.longest, .words = words};
  if (auto error = walk_sample(sample, tree, walk, printer)) {
    return tl::unexpected{std::move(*error)};
  }
  if (printer.enough()) {
    return tl::unexpected{
        fmt::format("the message would take more than {} bytes of text", max_printed_bytes)};
  }
  return printer.take();
}

tl::expected<TextValue, ValueError> parse_text(std::string_view text, ValueForm form) {
  return form == ValueForm::json ? parse_json_text(text) : parse_yaml_text(text);
}

}  // namespace

tl::expected<MessageValues, std::string> MessageValues::make(TypeTree tree, const MessageRules& rules) {
  auto plan = ConversionPlan::compile(tree, rules);
  if (!plan) {
    return tl::unexpected{std::move(plan.error())};
  }
  return MessageValues{std::move(tree), std::move(*plan), std::nullopt};
}

tl::expected<MessageValues, std::string> MessageValues::make(TypeTree tree, const MessageRules& rules,
                                                             Words words) {
  auto made = make(std::move(tree), rules);
  if (made) {
    made->words_ = std::move(words);
  }
  return made;
}

ConversionError MessageValues::in_words(ConversionError error) const {
  if (words_) {
    error.field = messages::in_words(error.field, tree_, *words_);
  }
  return error;
}

std::optional<ConversionError> MessageValues::fault_of(ByteView payload) const {
  ConversionScratch scratch;
  const auto sample = plan_.someip_to_cdr(payload, scratch);
  return sample ? std::nullopt : std::optional{in_words(sample.error())};
}

tl::expected<std::string, std::string> MessageValues::print(ByteView payload, ValueForm form,
                                                            const PrintOptions& options) const {
  ConversionScratch scratch;
  const auto sample = plan_.someip_to_cdr(payload, scratch);
  if (!sample) {
    const std::string& name = words_ && !words_->name.empty() ? words_->name : tree_.root().name;
    return tl::unexpected{fmt::format("not a {}: {}", name, to_string(in_words(sample.error())))};
  }
  return print_sample(joined(*sample), form, options);
}

tl::expected<std::string, std::string> MessageValues::print_sample(ByteView sample, ValueForm form,
                                                                   const PrintOptions& options) const {
  return form == ValueForm::json ? print_with<JsonPrinter>(sample, tree_, options, words())
                                 : print_with<YamlPrinter>(sample, tree_, options, words());
}

tl::expected<std::vector<std::byte>, ValueError> MessageValues::parse_sample(std::string_view text,
                                                                             ValueForm form) const {
  const auto value = parse_text(text, form);
  if (!value) {
    return tl::unexpected{value.error()};
  }
  return build_sample(*value, tree_, max_sample_bytes, words());
}

tl::expected<std::vector<std::byte>, ValueError> MessageValues::parse(std::string_view text,
                                                                      ValueForm form) const {
  const auto value = parse_text(text, form);
  if (!value) {
    return tl::unexpected{value.error()};
  }
  return to_payload(build_sample(*value, tree_, max_sample_bytes, words()), *value);
}

tl::expected<std::vector<std::byte>, ValueError> MessageValues::initial() const {
  TextValue nothing;
  nothing.kind = TextValue::Kind::mapping;
  return to_payload(build_sample(nothing, tree_, max_sample_bytes, words(), true), nothing);
}

tl::expected<std::vector<std::byte>, ValueError> MessageValues::to_payload(
    const tl::expected<std::vector<std::byte>, ValueError>& sample, const TextValue& text) const {
  if (!sample) {
    return tl::unexpected{sample.error()};
  }
  ConversionScratch scratch;
  const auto payload = plan_.cdr_to_someip(*sample, scratch);
  if (!payload) {
    // The sample is valid, so the failure is something that these wire rules cannot express.
    const ConversionError error = in_words(payload.error());
    const std::string why =
        error.fault == ConversionFault::length_overflow  ? "more bytes than the length field can say"
        : error.fault == ConversionFault::bound_exceeded ? "a number that does not fit into its bits"
        : error.fault == ConversionFault::bad_union  ? "a union that does not have exactly one of its fields"
        : error.fault == ConversionFault::bad_string ? "a string with a zero inside, where zeros end strings"
        : error.expected.empty()                     ? to_string(error.fault)
                                                     : error.expected;
    return tl::unexpected{ValueError{place_of(text, error.field), error.field, why}};
  }
  return joined(*payload);
}

}  // namespace trestle::messages
