#include <fmt/format.h>

#include "bridge/messages/types/number_text.hpp"
#include "bridge/messages/values/byte_text.hpp"
#include "bridge/messages/values/printers.hpp"
#include "bridge/messages/values/quoted.hpp"

namespace trestle::messages {

void append_bytes(std::string& out, BytesForm form, ByteView bytes) {
  if (form == BytesForm::base64) {
    append_base64(out, bytes);
  } else {
    out += "hex:";
    append_hex(out, bytes);
  }
}

void YamlPrinter::begin_message(const MessageDefinition& /*type*/) {
  messages_.push_back({.outer_indent = indent_});
}

void YamlPrinter::field(const std::string& name) {
  // A message begins with its first field: it may have none.
  if (!std::exchange(messages_.back().has_fields, true)) {
    if (before_ == Before::key) {
      out_ += '\n';
      indent_ += 2;
    } else if (before_ == Before::dash) {
      indent_ = arrays_.back().indent + 2;
    }
  }
  if (before_ != Before::dash) {  // the first field stands behind the dash
    out_.append(indent_, ' ');
  }
  if (is_plain_key(name)) {
    out_ += name;
  } else {
    append_quoted(out_, name);
  }
  out_ += ':';
  before_ = Before::key;
}

void YamlPrinter::end_message(const MessageDefinition& /*type*/) {
  const Message message = messages_.back();
  messages_.pop_back();
  if (!message.has_fields) {
    return scalar("{}");
  }
  indent_ = message.outer_indent;
  before_ = Before::nothing;
}

void YamlPrinter::begin_array(bool numbers, std::size_t size, std::size_t shown) {
  const bool flow = numbers || size == 0;
  std::size_t indent = indent_;
  if (before_ == Before::dash) {  // an array in an array
    out_ += flow ? "[" : "";
    indent = arrays_.back().indent + 2;
    same_line_ = !flow && shown > 0;
  } else {
    out_ += flow ? before_ == Before::key ? " [" : "[" : "\n";
  }
  arrays_.push_back({.flow = flow, .size = size, .shown = shown, .indent = indent});
  before_ = Before::nothing;
}

void YamlPrinter::element() {
  Array& array = arrays_.back();
  if (array.flow) {
    out_ += std::exchange(array.first, false) ? "" : ", ";
    return;
  }
  if (!std::exchange(same_line_, false)) {  // the first one stands behind the dash of the array around it
    out_.append(array.indent, ' ');
  }
  out_ += "- ";
  before_ = Before::dash;
}

void YamlPrinter::end_array() {
  const Array array = arrays_.back();
  arrays_.pop_back();
  const std::string rest =
      array.shown < array.size ? fmt::format("  # {} of {}", array.shown, array.size) : std::string{};
  if (array.flow) {
    out_ += rest.empty() ? "]" : array.shown == 0 ? "...]" : ", ...]";
    out_ += rest + "\n";
  } else if (!rest.empty()) {
    out_.append(array.indent, ' ');
    out_ += "- ..." + rest + "\n";
  }
  before_ = Before::nothing;
}

void YamlPrinter::whole(std::int64_t value) {
  scalar(std::to_string(value));
}

void YamlPrinter::natural(std::uint64_t value) {
  scalar(std::to_string(value));
}

template <std::floating_point T>
void YamlPrinter::floating(T value) {
  scalar(std::isnan(value)   ? ".nan"
         : std::isinf(value) ? (value < 0 ? "-.inf" : ".inf")
                             : std::string_view{shortest(value)});
}

void YamlPrinter::float32(float value) {
  floating(value);
}

void YamlPrinter::float64(double value) {
  floating(value);
}

void YamlPrinter::string(std::string_view text, std::size_t size) {
  if (text.size() == size && is_plain_yaml(text)) {
    return scalar(text);
  }
  std::string quoted;
  append_quoted(quoted, text);
  if (text.size() == size) {
    return scalar(quoted);
  }
  quoted.insert(quoted.size() - 1, "...");
  scalar(quoted, fmt::format("  # {} of {} bytes", text.size(), size));
}

void YamlPrinter::bytes(ByteView bytes, std::size_t size) {
  std::string text = bytes_form_ == BytesForm::base64 ? "!!binary \"" : "\"";
  append_bytes(text, bytes_form_, bytes);
  if (bytes.size() == size) {
    return scalar(text + "\"");
  }
  scalar(text + "...\"", fmt::format("  # {} of {} bytes", bytes.size(), size));
}

void YamlPrinter::scalar(std::string_view text, std::string_view comment) {
  if (in_flow()) {
    out_ += text;
    return;
  }
  if (before_ == Before::key) {
    out_ += ' ';
  }
  out_ += text;
  out_ += comment;
  out_ += '\n';
  before_ = Before::nothing;
}

}  // namespace trestle::messages
