// The rules of payloads.
#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "bridge/describe/lower_types.hpp"

namespace trestle::describe {
namespace {

using messages::ArrayKind;
using messages::TypeRules;
using someip::FieldWidth;

/// What most uses have, so that the rules of a payload are few, and its messages take the quick ways.
template <typename T>
class Votes {
 public:
  explicit Votes(T usual) : usual_{usual} {}
  void count(T value) { ++votes_[value]; }
  [[nodiscard]] T result() const {
    T best = usual_;
    std::size_t most = votes_.contains(usual_) ? votes_.at(usual_) : 0;
    for (const auto& [value, votes] : votes_) {
      if (votes > most) {
        best = value;
        most = votes;
      }
    }
    return best;
  }

 private:
  T usual_;
  std::map<T, std::size_t> votes_;
};

class RulesOf {
 public:
  RulesOf(const std::vector<Shape>& shapes, const Payload& payload) : shapes_{shapes} {
    rules_.payload.byte_order = payload.byte_order;
    rules_.payload.length_fields_always_big = payload.length_fields_always_big;
    rules_.payload.alignment = payload.alignment;
    rules_.payload.tagged_length = payload.tagged_length;
    rules_.payload.smallest_tagged_length = payload.smallest_tagged_length;
  }

  messages::MessageRules made(const std::vector<std::pair<std::size_t, std::optional<Wire>>>& roots) {
    std::set<std::size_t> seen;
    for (const auto& [root, wire] : roots) {
      visit(root, seen);
    }
    someip::PayloadRules& payload = rules_.payload;
    payload.array_length = array_.result();
    payload.fixed_array_length = fixed_array_.result();
    payload.string_length = string_.result();
    payload.string_encoding = encoding_.result();
    payload.string_bom = bom_.result();
    payload.string_terminator = terminator_.result();
    payload.struct_length = struct_.result();
    payload.union_length = union_.result();
    payload.union_type = selector_.result();
    payload.union_length_first = length_first_.result();
    for (const auto& [root, wire] : roots) {
      messages::TypeRules own = of_type(shapes_[root]);
      if (shapes_[root].form != TypeRules::Form::empty) {
        frame(own.itself, wire.value_or(Wire{}), shapes_[root]);
      }
      key(shapes_[root].definition.name, own);
    }
    for (auto& [name, all] : types_) {
      for (std::size_t i = 0; i < all.size(); ++i) {
        if (i > 0 || all[i] != messages::TypeRules{}) {
          rules_.types[variant(name, i)] = all[i];
        }
      }
    }
    return rules_;
  }

 private:
  void visit(std::size_t index, std::set<std::size_t>& seen) {
    if (!seen.insert(index).second) {
      return;
    }
    const Shape& shape = shapes_[index];
    rules_.default_missing = rules_.default_missing || shape.has_optional_array;
    for (const Shape::Use& use : shape.uses) {
      if (use.array && !use.tag) {
        (use.field.type.array == ArrayKind::fixed ? fixed_array_ : array_).count(use.array->length);
      }
      if (use.string) {
        if (use.string->length != FieldWidth::none && (!use.tag || use.array)) {
          string_.count(use.string->length);
        }
        encoding_.count(use.string->encoding);
        bom_.count(use.string->bom);
        terminator_.count(use.string->terminator);
      }
      if (use.nested) {
        const Shape& inner = shapes_[use.shape];
        if (inner.form == TypeRules::Form::choice) {
          union_.count(use.nested->length);
          selector_.count(use.nested->selector);
          length_first_.count(use.nested->length_first);
        } else if (inner.form == TypeRules::Form::structure) {
          struct_.count(use.nested->length);
        }
        visit(use.shape, seen);
      }
    }
  }

  static std::string variant(const std::string& name, std::size_t index) {
    return index == 0 ? name : fmt::format("{}#{}", name, index + 1);
  }

  /// The key of these rules.
  std::string key(const std::string& name, const messages::TypeRules& differences) {
    auto& all = types_[name];
    const auto found = std::ranges::find(all, differences);
    const auto index = static_cast<std::size_t>(found - all.begin());
    if (found == all.end()) {
      all.push_back(differences);
    }
    return variant(name, index);
  }

  template <typename T>
  static void differ(std::optional<T>& rule, T value, T usual) {
    if (value != usual) {
      rule = value;
    }
  }

  /// Of a message as a whole.
  void frame(messages::FieldRules& differences, const Wire& wire, const Shape& shape) const {
    const someip::PayloadRules& payload = rules_.payload;
    if (shape.form == TypeRules::Form::structure) {
      differ(differences.struct_length, wire.length, payload.struct_length);
    } else if (shape.form == TypeRules::Form::choice) {
      differ(differences.union_length, wire.length, payload.union_length);
      differ(differences.union_type, wire.selector, payload.union_type);
      differ(differences.union_length_first, wire.length_first, payload.union_length_first);
      if (wire.length == FieldWidth::none) {
        differences.union_bytes = wire.fixed_bytes;
      }
    }
  }

  messages::TypeRules of_type(const Shape& shape) {
    const someip::PayloadRules& payload = rules_.payload;
    messages::TypeRules own;
    own.form = shape.form;
    own.itself.selectors = shape.selectors;
    for (const Shape::Use& use : shape.uses) {
      messages::FieldRules differences;
      const bool is_single = !use.array;
      if (use.array && !use.tag) {
        differ(differences.array_length, use.array->length,
               use.field.type.array == ArrayKind::fixed ? payload.fixed_array_length : payload.array_length);
      }
      if (use.string) {
        if (use.string->length == FieldWidth::none) {
          own.fixed_strings[use.field.name] = use.string->fixed_bytes;
        } else if (!use.tag || !is_single) {
          differ(differences.string_length, use.string->length, payload.string_length);
        }
        differ(differences.encoding, use.string->encoding, payload.string_encoding);
        differ(differences.bom, use.string->bom, payload.string_bom);
        differ(differences.terminator, use.string->terminator, payload.string_terminator);
      }
      if (use.nested) {
        const Shape& inner = shapes_[use.shape];
        Wire wire = *use.nested;
        if (use.tag && is_single) {  // the tag's length field takes its place
          wire.length = inner.form == TypeRules::Form::choice ? payload.union_length : payload.struct_length;
        }
        frame(differences, wire, inner);
        if (use.tag && is_single) {
          differences.union_bytes.reset();
        }
        std::string wanted = key(inner.definition.name, of_known(use.shape));
        if (wanted != inner.definition.name) {
          differences.variant = std::move(wanted);
        }
      }
      differences.bits = use.bits;
      if (use.byte_order) {
        own.byte_orders[use.field.name] = *use.byte_order;
      }
      if (use.tag) {
        own.tags[use.field.name] = *use.tag;
      }
      if (differences != messages::FieldRules{}) {
        own.fields[use.field.name] = std::move(differences);
      }
    }
    return own;
  }

  const messages::TypeRules& of_known(std::size_t index) {
    auto known = known_.find(index);
    if (known == known_.end()) {
      known = known_.emplace(index, of_type(shapes_[index])).first;
    }
    return known->second;
  }

  const std::vector<Shape>& shapes_;
  messages::MessageRules rules_;
  std::map<std::string, std::vector<messages::TypeRules>> types_;
  std::map<std::size_t, messages::TypeRules> known_;
  Votes<FieldWidth> array_{FieldWidth::bits32};
  Votes<FieldWidth> fixed_array_{FieldWidth::none};
  Votes<FieldWidth> string_{FieldWidth::bits32};
  Votes<someip::StringEncoding> encoding_{someip::StringEncoding::utf8};
  Votes<bool> bom_{true};
  Votes<bool> terminator_{true};
  Votes<FieldWidth> struct_{FieldWidth::none};
  Votes<FieldWidth> union_{FieldWidth::bits32};
  Votes<FieldWidth> selector_{FieldWidth::bits32};
  Votes<bool> length_first_{true};
};

}  // namespace

messages::MessageRules rules_of(const std::vector<Shape>& shapes,
                                const std::vector<std::pair<std::size_t, std::optional<Wire>>>& roots,
                                const Payload& payload) {
  return RulesOf{shapes, payload}.made(roots);
}

}  // namespace trestle::describe
