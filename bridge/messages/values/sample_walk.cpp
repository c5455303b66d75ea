#include "bridge/messages/values/sample_walk.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <bit>

#include "bridge/messages/values/cdr.hpp"
#include "someip/wire/utf.hpp"

namespace trestle::messages {
namespace {

constexpr std::size_t cdr_header_bytes = 4;

/// At most `bytes` from the front of a text, not cutting a character in two.
std::string_view beginning(std::string_view text, std::size_t bytes) {
  if (bytes >= text.size()) {
    return text;
  }
  while (bytes > 0 && (static_cast<unsigned char>(text[bytes]) & 0xc0U) == 0x80) {
    --bytes;
  }
  return text.substr(0, bytes);
}

class Walk {
 public:
  Walk(CdrReader in, const TypeTree& tree, const WalkOptions& options, ValueSink& sink)
      : in_{in}, tree_{tree}, options_{options}, words_{options.words}, sink_{&sink} {}

  std::optional<std::string> run() {
    const std::size_t root = tree_.messages.size() - 1;
    const bool is_argument = words_ != nullptr && !words_->argument.empty();
    if (is_argument) {
      sink_->begin_message(tree_.root());
      sink_->field(words_->argument);
    }
    message(root);
    if (is_argument) {
      sink_->end_message(tree_.root());
    }
    if (in_.failed()) {
      return fmt::format("the sample ends before the message does: {} bytes read",
                         cdr_header_bytes + in_.position());
    }
    return std::nullopt;
  }

 private:
  void message(std::size_t index) {
    const MessageDefinition& type = tree_.messages[index];
    const MessageWords& words = words_ == nullptr ? Words::nothing : words_->of(index);
    if (words.form == MessageWords::Form::wrapper && type.fields.size() == 1) {
      return value(type.fields.front().type, words_of(words, 0));
    }
    sink_->begin_message(type);
    if (type.fields.empty()) {
      in_.take(1);  // what generates IDL puts a byte into empty messages
    }
    for (std::size_t at = 0; at < type.fields.size(); ++at) {
      if (in_.failed() || sink_->enough()) {
        return;
      }
      const FieldType& field = type.fields[at].type;
      const FieldWords& own = words_of(words, at);
      if (words.form == MessageWords::Form::choice || own.form == FieldWords::Form::optional) {
        if (is_there()) {
          sink_->field(name_of(words, type, at));
          single(field, own);
        }
        continue;
      }
      sink_->field(name_of(words, type, at));
      value(field, own);
    }
    sink_->end_message(type);
  }

  /// Of a T[<=1].
  bool is_there() {
    const auto count = in_.number<std::uint32_t>();
    if (count > 1) {
      in_.fail();
    }
    return count == 1 && !in_.failed();
  }

  void value(const FieldType& type, const FieldWords& words) {
    switch (type.array) {
      case ArrayKind::none:
        return single(type, words);
      case ArrayKind::fixed:
        return array(type, words, type.array_size);
      case ArrayKind::bounded:
      case ArrayKind::unbounded:
        return array(type, words, in_.number<std::uint32_t>());
    }
  }

  void array(const FieldType& type, const FieldWords& words, std::size_t size) {
    const std::size_t width_of_one = type.primitive ? width(*type.primitive) : 0;
    // Every element has at least one byte, also an empty message.
    if (in_.failed() || size > in_.left() / std::max<std::size_t>(width_of_one, 1)) {
      in_.fail();
      return;
    }
    const std::size_t shown = options_.longest == 0 ? size : std::min(size, options_.longest);
    const bool as_one =
        words.form == FieldWords::Form::bytes || (options_.bytes_as_one && words.enumerators == nullptr);
    if (as_one && width_of_one == 1 && *type.primitive != Primitive::boolean &&
        *type.primitive != Primitive::int8) {
      return sink_->bytes(in_.take(size).first(shown), size);
    }
    sink_->begin_array(width_of_one != 0, size, shown);
    for (std::size_t at = 0; at < shown && !in_.failed() && !sink_->enough(); ++at) {
      sink_->element();
      single(type, words);
    }
    if (width_of_one != 0) {
      in_.take((size - shown) * width_of_one);
    } else {
      skip(type, words, size - shown);
    }
    sink_->end_array();
  }

  /// Skips elements without reporting them.
  void skip(const FieldType& type, const FieldWords& words, std::size_t count) {
    ValueSink nobody;
    ValueSink* const sink = std::exchange(sink_, &nobody);
    for (; count > 0 && !in_.failed() && !sink->enough(); --count) {
      single(type, words);
    }
    sink_ = sink;
  }

  void single(const FieldType& type, const FieldWords& words) {
    if (!type.primitive) {
      return message(type.message_index);
    }
    switch (*type.primitive) {
      case Primitive::boolean:
        return sink_->boolean(in_.number<std::uint8_t>() != 0);
      case Primitive::string:
        return string();
      case Primitive::wstring:
        return wstring();
      default:
        return visit_number(*type.primitive, [&]<typename T>(T /*zero*/) {
          tell(std::bit_cast<T>(in_.number<BitsOf<T>>()), words);
        });
    }
  }

  template <std::integral T>
  void tell(T number, const FieldWords& words) {
    if (const std::string* const name = enumerator_of(words, static_cast<std::int64_t>(number))) {
      return sink_->string(*name, name->size());
    }
    tell(number);
  }
  void tell(std::floating_point auto number, const FieldWords& /*words*/) { tell(number); }

  void tell(std::signed_integral auto number) { sink_->whole(number); }
  void tell(std::unsigned_integral auto number) { sink_->natural(number); }
  void tell(float number) { sink_->float32(number); }
  void tell(double number) { sink_->float64(number); }

  void string() {
    const std::size_t size = in_.number<std::uint32_t>();
    const ByteView bytes = in_.take(size);
    if (bytes.empty()) {
      return sink_->string({}, 0);  // size 0 has no terminator; read as the empty string
    }
    // Characters may alias anything, so this one cast is sound.
    tell({reinterpret_cast<const char*>(bytes.data()), bytes.size() - 1});  // NOLINT(*-reinterpret-cast)
  }

  void wstring() {
    const std::size_t units = in_.number<std::uint32_t>();
    if (in_.failed() || units > in_.left() / 4) {
      in_.fail();
      return;
    }
    wide_.clear();
    for (std::size_t at = 0; at < units; ++at) {
      std::array<std::byte, 2> unit{};
      someip::store(unit.data(), static_cast<std::uint16_t>(in_.number<std::uint32_t>()));
      wide_.insert(wide_.end(), unit.begin(), unit.end());
    }
    text_.clear();
    for (ByteView rest = wide_; !rest.empty();) {
      const auto character = someip::first_utf16(rest, std::endian::big);
      const char32_t code = character ? character->code : 0xfffd;
      std::array<std::byte, 4> utf8{};
      someip::put_utf8(code, utf8.data());
      for (std::size_t at = 0; at < someip::utf8_bytes(code); ++at) {
        text_ += static_cast<char>(utf8[at]);
      }
      rest = rest.subspan(character ? character->bytes : 2);
    }
    tell(text_);
  }

  void tell(std::string_view text) {
    sink_->string(options_.longest == 0 ? text : beginning(text, options_.longest), text.size());
  }

  CdrReader in_;
  const TypeTree& tree_;
  const WalkOptions& options_;
  const Words* words_;
  ValueSink* sink_;
  std::vector<std::byte> wide_;
  std::string text_;
};

}  // namespace

std::optional<std::string> walk_sample(ByteView sample, const TypeTree& tree, const WalkOptions& options,
                                       ValueSink& sink) {
  if (sample.size() < cdr_header_bytes || sample[0] != std::byte{0} || sample[1] > std::byte{1}) {
    return "not a sample in plain CDR";
  }
  const std::endian order = sample[1] == std::byte{0} ? std::endian::big : std::endian::little;
  return Walk{CdrReader{sample.subspan(cdr_header_bytes), order}, tree, options, sink}.run();
}

}  // namespace trestle::messages
