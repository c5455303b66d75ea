#include <fmt/format.h>

#include <utility>

#include "bridge/messages/types/number_text.hpp"
#include "bridge/messages/values/printers.hpp"
#include "bridge/messages/values/quoted.hpp"

namespace trestle::messages {

void JsonPrinter::begin_message(const MessageDefinition& /*type*/) {
  out_ += '{';
  first_ = true;
}

void JsonPrinter::field(const std::string& name) {
  separate();
  append_quoted(out_, name);
  out_ += ':';
}

void JsonPrinter::end_message(const MessageDefinition& /*type*/) {
  out_ += '}';
  first_ = false;
}

void JsonPrinter::begin_array(bool /*numbers*/, std::size_t size, std::size_t shown) {
  out_ += '[';
  first_ = true;
  hidden_.push_back(size - shown);
}

void JsonPrinter::end_array() {
  if (hidden_.back() != 0) {
    separate();
    out_ += fmt::format("\"... {} more\"", hidden_.back());
  }
  hidden_.pop_back();
  out_ += ']';
  first_ = false;
}

template <std::floating_point T>
void JsonPrinter::floating(T value) {
  // JSON has no words for these. Protocol Buffers write them so, too.
  if (std::isnan(value)) {
    out_ += "\"NaN\"";
  } else if (std::isinf(value)) {
    out_ += value < 0 ? "\"-Infinity\"" : "\"Infinity\"";
  } else {
    out_ += shortest(value);
  }
}

void JsonPrinter::float32(float value) {
  floating(value);
}

void JsonPrinter::float64(double value) {
  floating(value);
}

void JsonPrinter::string(std::string_view text, std::size_t size) {
  append_quoted(out_, text);
  if (text.size() < size) {
    out_.insert(out_.size() - 1, "...");
  }
}

void JsonPrinter::bytes(ByteView bytes, std::size_t size) {
  out_ += '"';
  append_bytes(out_, bytes_form_, bytes);
  out_ += bytes.size() < size ? "...\"" : "\"";
}

void JsonPrinter::separate() {
  if (!std::exchange(first_, false)) {
    out_ += ',';
  }
}

}  // namespace trestle::messages
