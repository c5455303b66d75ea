#pragma once
#include <string>
#include <vector>

#include "bridge/messages/values/message_values.hpp"
#include "bridge/messages/values/sample_walk.hpp"

namespace trestle::messages {

/// Writes what it is told as YAML in the style of `ros2 topic echo`: messages and their arrays as blocks,
/// arrays of numbers on one line.
class YamlPrinter : public ValueSink {
 public:
  explicit YamlPrinter(BytesForm bytes_form) : bytes_form_{bytes_form} {}
  [[nodiscard]] std::string take() { return std::move(out_); }

  void begin_message(const MessageDefinition& type) override;
  void field(const std::string& name) override;
  void end_message(const MessageDefinition& type) override;
  void begin_array(bool numbers, std::size_t size, std::size_t shown) override;
  void element() override;
  void end_array() override;
  void boolean(bool value) override { scalar(value ? "true" : "false"); }
  void whole(std::int64_t value) override;
  void natural(std::uint64_t value) override;
  void float32(float value) override;
  void float64(double value) override;
  void string(std::string_view text, std::size_t size) override;
  void bytes(ByteView bytes, std::size_t size) override;
  [[nodiscard]] bool enough() const override { return out_.size() > max_printed_bytes; }

 private:
  /// What stands before the value that comes next.
  enum class Before : std::uint8_t { nothing, key, dash };
  struct Array {
    bool flow = false;
    std::size_t size = 0;
    std::size_t shown = 0;
    bool first = true;
    std::size_t indent = 0;  ///< of the dashes
  };
  struct Message {
    std::size_t outer_indent = 0;
    bool has_fields = false;  ///< one has been printed
  };

  template <std::floating_point T>
  void floating(T value);
  void scalar(std::string_view text, std::string_view comment = {});
  [[nodiscard]] bool in_flow() const { return !arrays_.empty() && arrays_.back().flow; }

  BytesForm bytes_form_;
  std::string out_;
  std::size_t indent_ = 0;
  std::vector<Message> messages_;  ///< those that are open
  std::vector<Array> arrays_;
  Before before_ = Before::nothing;
  bool same_line_ = false;  ///< the next element stands behind the dash of the one around it
};

/// Writes what it is told as JSON on one line.
class JsonPrinter : public ValueSink {
 public:
  explicit JsonPrinter(BytesForm bytes_form) : bytes_form_{bytes_form} {}
  [[nodiscard]] std::string take() { return std::move(out_); }

  void begin_message(const MessageDefinition& type) override;
  void field(const std::string& name) override;
  void end_message(const MessageDefinition& type) override;
  void begin_array(bool numbers, std::size_t size, std::size_t shown) override;
  void element() override { separate(); }
  void end_array() override;
  void boolean(bool value) override { out_ += value ? "true" : "false"; }
  void whole(std::int64_t value) override { out_ += std::to_string(value); }
  void natural(std::uint64_t value) override { out_ += std::to_string(value); }
  void float32(float value) override;
  void float64(double value) override;
  void string(std::string_view text, std::size_t size) override;
  void bytes(ByteView bytes, std::size_t size) override;
  [[nodiscard]] bool enough() const override { return out_.size() > max_printed_bytes; }

 private:
  template <std::floating_point T>
  void floating(T value);
  /// A comma, but not before the first of several.
  void separate();

  BytesForm bytes_form_;
  std::string out_;
  bool first_ = true;
  std::vector<std::size_t> hidden_;  ///< elements not shown, of the arrays that are open
};

/// Appends bytes as the content of a string: base64, or "hex:" and digits.
void append_bytes(std::string& out, BytesForm form, ByteView bytes);

}  // namespace trestle::messages
