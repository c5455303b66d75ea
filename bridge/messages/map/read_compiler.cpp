#include "bridge/messages/map/read_compiler.hpp"

#include <fmt/format.h>

#include "bridge/messages/convert/conversion_plan.hpp"
#include "bridge/messages/map/type_paths.hpp"

namespace trestle::messages {
namespace {

class ReadCompiler {
 public:
  ReadCompiler(MapProgram& program, const SlotsByField& slots) : program_{program}, slots_{slots} {}

  bool fields(const MessageDefinition& message, const std::string& prefix) {
    if (message.fields.empty()) {
      add({.kind = ReadOp::Kind::numbers}, prefix);
    }
    for (const Field& field : message.fields) {
      if (!part(field.type, prefix + field.name)) {
        return false;
      }
    }
    return true;
  }

 private:
  bool part(const FieldType& type, const std::string& path) {
    if (program_.reads.size() > max_fields_per_type) {
      return false;
    }
    const auto slot = slots_.find(path);
    ReadOp op{.slot = slot == slots_.end() ? no_slot : slot->second};
    const bool has_inner = has_within(slots_, path);
    if (has_inner && op.slot != no_slot) {
      op.kind = ReadOp::Kind::place;
      add(op, path);
    }
    if (is_message(type)) {
      return fields(program_.from.messages[type.message_index], path + ".");
    }
    if (has_inner) {  // an array of fixed size, as the names were checked
      for (std::uint32_t i = 0; i < type.array_size; ++i) {
        if (!part(element_of(type), fmt::format("{}[{}]", path, i))) {
          return false;
        }
      }
      return true;
    }
    if (is_number(type)) {
      op.kind = is_sequence(type) ? ReadOp::Kind::sequence : ReadOp::Kind::numbers;
      op.width = width(*type.primitive);
      op.count = type.array == ArrayKind::fixed ? type.array_size : 1;
    } else if (type.primitive && type.array == ArrayKind::none) {
      op.kind = *type.primitive == Primitive::string ? ReadOp::Kind::string : ReadOp::Kind::wstring;
    } else {
      op.kind = ReadOp::Kind::other;
      op.type = static_cast<std::uint32_t>(program_.types.size());
      program_.types.push_back(type);
    }
    add(op, path);
    return true;
  }

  /// Numbers that nobody wants are one operation together.
  void add(const ReadOp& op, const std::string& path) {
    if (!program_.reads.empty() && op.kind == ReadOp::Kind::numbers && op.slot == no_slot) {
      ReadOp& last = program_.reads.back();
      if (last.kind == op.kind && last.slot == no_slot && last.width == op.width) {
        last.count += op.count;
        return;
      }
    }
    program_.reads.push_back(op);
    program_.read_labels.push_back(path);
  }

  MapProgram& program_;
  const SlotsByField& slots_;
};

void find_unused(const TypeTree& tree, const MessageDefinition& message, const std::string& prefix,
                 const SlotsByField& slots, const std::set<std::string, std::less<>>& known,
                 std::vector<std::string>& into) {
  for (const Field& field : message.fields) {
    const std::string path = prefix + field.name;
    if (slots.contains(path) || known.contains(path)) {
      continue;
    }
    if (!has_within(slots, path) && !has_within(known, path)) {
      into.push_back(path);
    } else if (is_message(field.type)) {
      find_unused(tree, tree.messages[field.type.message_index], path + ".", slots, known, into);
    }
  }
}

}  // namespace

bool compile_reads(MapProgram& program, const SlotsByField& slots) {
  return ReadCompiler{program, slots}.fields(program.from.root(), "");
}

std::vector<std::string> unused_fields(const TypeTree& tree, const SlotsByField& slots,
                                       const std::set<std::string, std::less<>>& known) {
  std::vector<std::string> unused;
  find_unused(tree, tree.root(), "", slots, known, unused);
  return unused;
}

}  // namespace trestle::messages
