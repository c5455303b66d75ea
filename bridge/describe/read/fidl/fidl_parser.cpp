#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <utility>

#include "bridge/describe/fidl_words.hpp"
#include "bridge/describe/read/fidl/fidl_tree.hpp"
#include "bridge/messages/types/characters.hpp"

namespace trestle::describe::fidl {
namespace {

constexpr std::array<std::pair<std::string_view, messages::Primitive>, 11> primitives{
    {{"Int8", messages::Primitive::int8},
     {"UInt8", messages::Primitive::uint8},
     {"Int16", messages::Primitive::int16},
     {"UInt16", messages::Primitive::uint16},
     {"Int32", messages::Primitive::int32},
     {"UInt32", messages::Primitive::uint32},
     {"Int64", messages::Primitive::int64},
     {"UInt64", messages::Primitive::uint64},
     {"Boolean", messages::Primitive::boolean},
     {"Float", messages::Primitive::float32},
     {"Double", messages::Primitive::float64}}};

std::string trimmed(std::string_view text) {
  return std::string{messages::trimmed(text, " \t\r\n")};
}

/// Lines of an annotation are indented as the file is.
std::string unindented(std::string_view text) {
  std::string result;
  for (std::size_t at = 0; at <= text.size();) {
    const std::size_t end = std::min(text.find('\n', at), text.size());
    result += (at == 0 ? "" : "\n") + trimmed(text.substr(at, end - at));
    at = end + 1;
  }
  return trimmed(result);
}

/// "\@" and "\*" stand for the characters that would end an annotation.
std::string unescaped(std::string_view text) {
  std::string result;
  for (std::size_t at = 0; at < text.size(); ++at) {
    if (text[at] == '\\' && at + 1 < text.size()) {
      ++at;
    }
    result += text[at];
  }
  return result;
}

/// What annotations tell a reader that FIDL has no place for: as Trestle writes it.
struct Told {
  std::optional<std::string> name{};   ///< the name of an element whose own FIDL cannot have
  bool is_inout = false;               ///< Variable::is_inout
  std::optional<std::string> wraps{};  ///< the field of a struct: TypeTree::wraps
};

/// Reads "@description: … @unit: …".
Notes to_notes(std::string_view annotations, Told& told) {
  Notes notes;
  // Franca wants "\@" for any other; people write "@author: Me <me@example.com>".
  const auto is_start = [&](std::size_t at) {
    return annotations[at] == '@' &&
           (at == 0 || std::string_view{" \t\r\n"}.find(annotations[at - 1]) != std::string_view::npos);
  };
  std::size_t at = 0;
  while (at < annotations.size() && !is_start(at)) {
    ++at;
  }
  while (at < annotations.size()) {
    std::size_t end = at + 1;
    while (end < annotations.size() && !is_start(end)) {
      ++end;
    }
    const std::string_view piece = annotations.substr(at, end - at);
    at = end;
    const std::size_t colon = std::min(piece.find(':'), piece.size());
    const std::string name = trimmed(piece.substr(0, colon));
    const std::string text = unescaped(unindented(piece.substr(std::min(colon + 1, piece.size()))));
    const auto detail = [&](std::string_view what) {
      return name == "@details" && text.starts_with(what)
                 ? std::optional{trimmed(std::string_view{text}.substr(what.size()))}
                 : std::nullopt;
    };
    if (name == "@description") {
      notes.description += (notes.description.empty() ? "" : "\n") + text;
    } else if (name == "@unit") {
      notes.unit = text;
    } else if (const auto unit = detail("unit:")) {
      notes.unit = *unit;
    } else if (const auto own = detail("name:")) {
      told.name = *own;
    } else if (const auto inout = detail("inout:")) {
      told.name = *inout;
      told.is_inout = true;
    } else if (const auto wrapped = detail("wraps:")) {
      told.wraps = *wrapped;
    } else {
      std::string& other = notes.others[name];
      other += (other.empty() ? "" : "\n") + text;
    }
  }
  return notes;
}

class FidlParser {
 public:
  FidlParser(std::string_view text, std::uint32_t file, TokenCount& count, Problems& findings)
      : at_{text, file, count, findings} {}
  FidlTree file();

 private:
  static bool starts_root(const Token& token) {
    return token.is("interface") || token.is("typeCollection") || token.is("import") || token.is("package") ||
           token.kind == Token::Kind::annotation;
  }
  static bool starts_member(const Token& token) {
    for (const std::string_view word :
         {"attribute", "method", "broadcast", "const", "array", "struct", "union", "enumeration", "map",
          "typedef", "public", "contract", "version"}) {
      if (token.is(word)) {
        return true;
      }
    }
    return token.kind == Token::Kind::annotation;
  }

  Notes notes();
  Name new_name(std::string_view what) {
    Name name = at_.name(what, fidl_keywords());
    name.renamed_from = std::exchange(told_.name, std::nullopt);
    return name;
  }
  void import_line(FidlTree& file);
  void collection(FidlTree& file, Notes notes);
  void version(CollectionTree& into);
  void member(CollectionTree& into);
  void attribute(CollectionTree& into, Notes notes);
  void method(CollectionTree& into, Notes notes);
  void broadcast(CollectionTree& into, Notes notes);
  void constant(CollectionTree& into, Notes notes);
  void type(CollectionTree& into, Notes notes);
  void contract();
  std::string selector();
  std::vector<Variable> variables(std::string_view what);
  Variable variable(std::string_view what);
  TypeRef type_ref(bool with_array);
  std::vector<EnumeratorTree> enumerators();
  Expression initializer(int deep);
  Expression compound(int deep);
  Expression bracket(int deep);
  Expression binary(int deep, int level);
  Expression primary(int deep);
  bool too_deep(int deep);

  Cursor at_;
  Told told_{};  ///< of the element whose annotations came last
};

Notes FidlParser::notes() {
  Notes all;
  told_ = {};
  while (at_.at(Token::Kind::annotation)) {
    Notes more = to_notes(at_.take().text, told_);
    all.description += (all.description.empty() || more.description.empty() ? "" : "\n") + more.description;
    all.unit = more.unit.empty() ? all.unit : more.unit;
    all.others.merge(more.others);
  }
  return all;
}

FidlTree FidlParser::file() {
  FidlTree file;
  notes();  // of the package: for nobody
  if (at_.take_if("package")) {
    file.package = at_.dotted("the name of a package").text;
  } else {
    at_.fail("'package' at the beginning of the file");
  }
  while (!at_.at_end() && !at_.findings().full()) {
    if (at_.lost()) {
      at_.recover(0, starts_root);
      if (at_.at("}")) {
        at_.take();
      }
      continue;
    }
    Notes before = notes();
    if (at_.at("import")) {
      import_line(file);
    } else if (at_.at("interface") || at_.at("typeCollection")) {
      collection(file, std::move(before));
    } else if (!at_.at_end()) {
      at_.fail("'import', 'typeCollection' or 'interface'");
      at_.take();
    }
  }
  return file;
}

void FidlParser::import_line(FidlTree& file) {
  ImportTree import{.place = at_.here()};
  at_.take();
  if (!at_.take_if("model") && !at_.at(Token::Kind::string)) {
    import.names = at_.dotted("'model', or a name").text;
    if (at_.take_if(".")) {
      at_.expect("*", "behind the dot");
      import.names += ".*";
    }
    at_.expect("from", "behind the imported name");
  }
  import.file = at_.text("the name of a file in quotes");
  if (!at_.lost()) {
    file.imports.push_back(std::move(import));
  }
}

void FidlParser::collection(FidlTree& file, Notes notes) {
  CollectionTree& into = file.collections.emplace_back();
  into.notes = std::move(notes);
  into.is_interface = at_.at("interface");
  into.name.place = at_.here();
  at_.take();
  if (into.is_interface || !at_.at("{")) {
    into.name = new_name(into.is_interface ? "the name of an interface" : "the name of a type collection");
  }
  if (into.is_interface && at_.take_if("extends")) {
    into.base = at_.dotted("the name of the interface that is extended");
  }
  if (into.is_interface && at_.take_if("manages")) {
    do {
      into.manages.push_back(at_.dotted("the name of an interface"));
    } while (at_.take_if(","));
  }
  if (!at_.expect("{", into.is_interface ? "before the members of the interface" : "before the types")) {
    return;
  }
  const int depth = at_.depth();
  while (!at_.at_end() && !at_.findings().full() && at_.depth() >= depth && !at_.at("}")) {
    member(into);
    if (at_.lost()) {
      at_.recover(depth, [](const Token& token) { return starts_member(token) || starts_root(token); });
      // An interface within an interface: a brace is missing.
      if (at_.at("interface") || at_.at("typeCollection")) {
        at_.reset_depth();
        return;
      }
    }
  }
  if (at_.depth() >= depth) {
    at_.expect("}", "at the end");
  }
}

void FidlParser::member(CollectionTree& into) {
  Notes before = notes();
  at_.take_if("public");
  if (at_.at("version")) {
    version(into);
  } else if (at_.at("const")) {
    constant(into, std::move(before));
  } else if (at_.at("array") || at_.at("struct") || at_.at("union") || at_.at("enumeration") ||
             at_.at("map") || at_.at("typedef")) {
    type(into, std::move(before));
  } else if (into.is_interface && at_.at("attribute")) {
    attribute(into, std::move(before));
  } else if (into.is_interface && at_.at("method")) {
    method(into, std::move(before));
  } else if (into.is_interface && at_.at("broadcast")) {
    broadcast(into, std::move(before));
  } else if (into.is_interface && at_.at("contract")) {
    contract();
  } else if (!at_.at("}")) {
    at_.fail(into.is_interface
                 ? "an attribute, a method, a broadcast, a constant or a type"
                 : "a constant or a type: const, array, struct, union, enumeration, map, typedef");
    // Not the same place again.
    if (!at_.at_end() && !at_.peek().is("interface") && !at_.peek().is("typeCollection")) {
      at_.take();
    }
  }
}

void FidlParser::version(CollectionTree& into) {
  at_.take();
  at_.expect("{", "behind 'version'");
  at_.expect("major", "in a version");
  const auto major = at_.whole("the number of the major version");
  at_.expect("minor", "behind the major version");
  const auto minor = at_.whole("the number of the minor version");
  at_.expect("}", "behind a version");
  if (major && minor) {
    into.has_version = true;
    into.major = *major;
    into.minor = *minor;
  }
}

void FidlParser::attribute(CollectionTree& into, Notes notes) {
  at_.take();
  AttributeTree attribute{.value = variable("the name of an attribute")};
  attribute.value.notes = std::move(notes);
  for (;;) {
    if (at_.take_if("readonly")) {
      attribute.readonly = true;
    } else if (at_.take_if("noRead")) {
      attribute.no_read = true;
    } else if (at_.take_if("noSubscriptions")) {
      attribute.no_subscriptions = true;
    } else {
      break;
    }
  }
  if (!attribute.value.name.empty()) {
    into.attributes.push_back(std::move(attribute));
  }
}

std::string FidlParser::selector() {
  return at_.take_if(":") ? new_name("a selector").text : std::string{};
}

void FidlParser::method(CollectionTree& into, Notes notes) {
  at_.take();
  MethodTree method;
  method.notes = std::move(notes);
  method.name = new_name("the name of a method");
  method.selector = selector();
  method.fire_and_forget = at_.take_if("fireAndForget");
  at_.expect("{", "behind the name of a method");
  while (!at_.lost() && !at_.at("}")) {
    this->notes();  // of its error: for nobody
    if (at_.take_if("in")) {
      method.in = variables("an argument");
    } else if (at_.take_if("out")) {
      method.out = variables("an argument");
    } else if (at_.take_if("error")) {
      if (at_.at("{") || at_.at("extends")) {
        method.own_error = std::make_unique<TypeTree>();
        method.own_error->kind = Kind::enumeration;
        method.own_error->name.place = at_.here();
        if (at_.take_if("extends")) {
          method.own_error->base = at_.dotted("the name of an enumeration");
        }
        method.own_error->enumerators = enumerators();
      } else {
        method.error = at_.dotted("'{', 'extends' or the name of an enumeration");
      }
    } else {
      at_.fail("'in', 'out', 'error' or '}' in a method");
    }
  }
  at_.expect("}", "at the end of a method");
  if (!method.name.empty()) {
    into.methods.push_back(std::move(method));
  }
}

void FidlParser::broadcast(CollectionTree& into, Notes notes) {
  at_.take();
  BroadcastTree broadcast;
  broadcast.notes = std::move(notes);
  broadcast.name = new_name("the name of a broadcast");
  broadcast.selector = selector();
  broadcast.selective = at_.take_if("selective");
  at_.expect("{", "behind the name of a broadcast");
  if (at_.take_if("out")) {
    broadcast.out = variables("an argument");
  }
  at_.expect("}", "at the end of a broadcast");
  if (!broadcast.name.empty()) {
    into.broadcasts.push_back(std::move(broadcast));
  }
}

void FidlParser::constant(CollectionTree& into, Notes notes) {
  at_.take();
  const Variable variable = this->variable("the name of a constant");
  at_.expect("=", "behind the name of a constant");
  Expression value = initializer(0);
  if (!at_.lost()) {
    into.constants.push_back({variable.type, variable.name, std::move(value), std::move(notes)});
  }
}

void FidlParser::type(CollectionTree& into, Notes notes) {
  const Token word = at_.take();
  TypeTree type;
  type.notes = std::move(notes);
  type.name = new_name("the name of a type");
  const std::optional<std::string> wraps = told_.wraps;
  const auto extends = [&] {
    if (at_.take_if("extends")) {
      type.base = at_.dotted("the name of the type that is extended");
    }
  };
  if (word.text == "array") {
    type.kind = Kind::array;
    at_.expect("of", "behind the name of an array");
    type.element = type_ref(false);
  } else if (word.text == "typedef") {
    type.kind = Kind::alias;
    at_.expect("is", "behind the name of a typedef");
    type.element = type_ref(false);
  } else if (word.text == "map") {
    type.kind = Kind::map;
    at_.expect("{", "behind the name of a map");
    type.key = type_ref(false);
    at_.expect("to", "between the types of a map");
    type.element = type_ref(false);
    at_.expect("}", "at the end of a map");
  } else if (word.text == "enumeration") {
    type.kind = Kind::enumeration;
    extends();
    type.enumerators = enumerators();
  } else {
    type.kind = word.text == "union" ? Kind::choice : Kind::structure;
    extends();
    type.polymorphic = type.kind == Kind::structure && at_.take_if("polymorphic");
    type.fields = variables("a field");
    type.wraps = type.kind == Kind::structure && type.base.empty() && type.fields.size() == 1 &&
                 wraps == type.fields.front().name.text;
  }
  if (!type.name.empty()) {
    into.types.push_back(std::move(type));
  }
}

/// Tells nothing about bytes, and no other language has it.
void FidlParser::contract() {
  at_.findings().warning(at_.here(), "contracts are skipped: no target has this one");
  at_.take();
  at_.expect("{", "behind 'contract'");
  const int depth = at_.depth();
  while (!at_.lost() && !at_.at_end() && !(at_.at("}") && at_.depth() == depth)) {
    at_.take();
  }
  at_.expect("}", "at the end of the contract");
}

std::vector<Variable> FidlParser::variables(std::string_view what) {
  std::vector<Variable> all;
  at_.expect("{", fmt::format("before {}s", what == "a field" ? "field" : "argument"));
  while (!at_.lost() && !at_.at("}")) {
    Notes before = notes();
    Variable one = variable(what == "a field" ? "the name of a field" : "the name of an argument");
    one.notes = std::move(before);
    one.is_inout = told_.is_inout;
    at_.take_if(",");
    if (!one.name.empty()) {
      all.push_back(std::move(one));
    }
  }
  at_.expect("}", what == "a field" ? "behind the fields" : "behind the arguments");
  return all;
}

Variable FidlParser::variable(std::string_view what) {
  Variable variable;
  variable.type = type_ref(true);
  variable.name = new_name(what);
  return variable;
}

TypeRef FidlParser::type_ref(bool with_array) {
  TypeRef ref;
  ref.name = at_.dotted("a type");
  ref.basic = !ref.name.escaped && is_basic(ref.name.text);
  if (ref.name.text == "Integer" && ref.basic && at_.take_if("(")) {
    if (!at_.take_if("minInt")) {
      ref.minimum = at_.whole("a number or 'minInt'");
    }
    at_.expect(",", "between the bounds of an Integer");
    if (!at_.take_if("maxInt")) {
      ref.maximum = at_.whole("a number or 'maxInt'");
    }
    at_.expect(")", "behind the bounds of an Integer");
  }
  if (with_array && at_.take_if("[")) {
    ref.array =
        at_.expect("]", "behind '[': FIDL has no arrays of a fixed size, they are made by deployment");
  }
  return ref;
}

std::vector<EnumeratorTree> FidlParser::enumerators() {
  std::vector<EnumeratorTree> all;
  at_.expect("{", "before enumerators");
  while (!at_.lost() && !at_.at("}")) {
    EnumeratorTree one;
    one.notes = notes();
    one.name = new_name("the name of an enumerator");
    if (at_.take_if("=")) {
      one.value = binary(0, 2);
    }
    at_.take_if(",");
    if (!at_.lost()) {
      all.push_back(std::move(one));
    }
  }
  at_.expect("}", "behind the enumerators");
  return all;
}

bool FidlParser::too_deep(int deep) {
  if (deep > deepest_expression) {
    at_.fail(fmt::format("an expression that is nested at most {} deep", deepest_expression));
    return true;
  }
  return false;
}

Expression FidlParser::initializer(int deep) {
  if (too_deep(deep)) {
    return {};
  }
  return at_.at("{") ? compound(deep) : at_.at("[") ? bracket(deep) : binary(deep, 0);
}

Expression FidlParser::compound(int deep) {
  Expression all{.kind = Expression::Kind::compound, .place = at_.here()};
  at_.take();
  while (!at_.lost() && !at_.at("}")) {
    all.names.push_back(new_name("the name of a field"));
    at_.expect(":", "behind the name of a field");
    all.parts.push_back(initializer(deep + 1));
    if (!at_.take_if(",")) {
      break;
    }
  }
  at_.expect("}", "behind the values of fields");
  return all;
}

Expression FidlParser::bracket(int deep) {
  Expression all{.kind = Expression::Kind::bracket, .place = at_.here()};
  at_.take();
  while (!at_.lost() && !at_.at("]")) {
    all.parts.push_back(initializer(deep + 1));
    if (at_.take_if("=>")) {
      all.pairs = true;
      all.parts.push_back(initializer(deep + 1));
    }
    if (!at_.take_if(",")) {
      break;
    }
  }
  at_.expect("]", "behind the values of elements");
  return all;
}

/// Operators that bind more loosely have the lower level.
Expression FidlParser::binary(int deep, int level) {
  static const std::array<std::vector<std::string_view>, 6> operators{
      {{"||"}, {"&&"}, {"==", "!="}, {"<", "<=", ">", ">="}, {"+", "-"}, {"*", "/"}}};
  if (too_deep(deep)) {
    return {};
  }
  if (level == static_cast<int>(operators.size())) {
    return primary(deep);
  }
  Expression left = binary(deep, level + 1);
  int parts = 0;
  for (;;) {
    const auto& here = operators.at(static_cast<std::size_t>(level));
    const auto found = std::ranges::find_if(here, [&](std::string_view sign) { return at_.at(sign); });
    if (found == here.end() || at_.lost() || too_deep(++parts)) {
      return left;
    }
    Expression all{.kind = Expression::Kind::binary, .text = std::string{*found}, .place = at_.here()};
    at_.take();
    all.parts.push_back(std::move(left));
    all.parts.push_back(binary(deep + 1, level + 1));
    left = std::move(all);
  }
}

Expression FidlParser::primary(int deep) {
  Expression one{.place = at_.here()};
  if (at_.at("-") || at_.at("!")) {
    one.kind = Expression::Kind::unary;
    one.text = at_.take().text;
    if (!too_deep(deep)) {
      one.parts.push_back(primary(deep + 1));
    }
  } else if (at_.take_if("(")) {
    one = binary(deep + 1, 0);
    at_.expect(")", "behind an expression");
  } else if (at_.at(Token::Kind::string)) {
    one.kind = Expression::Kind::text;
    one.text = unquoted(at_.take().text);
  } else if (at_.at(Token::Kind::number)) {
    one.text = at_.take().text;
    if (!to_whole(one.text)) {
      one.kind = Expression::Kind::real;
      if (one.text.find('.') == std::string::npos) {
        at_.findings().error(one.place, fmt::format("the number {} has more than 64 bits", one.text));
      } else if (one.text.back() == 'd' || one.text.back() == 'f') {
        one.text.pop_back();
      } else {
        at_.findings().warning(one.place,
                               fmt::format("FIDL writes {0}d for a Double and {0}f for a Float; {0} alone "
                                           "is not valid for Franca",
                                           one.text));
      }
    }
  } else if (at_.at("true") || at_.at("false")) {
    one.kind = Expression::Kind::truth;
    one.text = at_.take().text;
  } else {
    one.kind = Expression::Kind::name;
    one.text = at_.dotted("a value").text;
  }
  // A part of a constant.
  for (int parts = 0; at_.at("->") && !too_deep(++parts);) {
    Expression part{
        .kind = Expression::Kind::unary, .text = std::string{at_.take().text}, .place = one.place};
    part.names.push_back(at_.dotted("the name of a field"));
    part.parts.push_back(std::move(one));
    one = std::move(part);
  }
  return one;
}

}  // namespace

std::optional<messages::Primitive> primitive_of(std::string_view name) {
  const auto found =
      std::ranges::find(primitives, name, &std::pair<std::string_view, messages::Primitive>::first);
  return found == primitives.end() ? std::nullopt : std::optional{found->second};
}

bool is_basic(std::string_view name) {
  return primitive_of(name) || name == "String" || name == "ByteBuffer" || name == "Integer" ||
         name == "undefined";
}

FidlTree parse_fidl(std::string_view text, std::uint32_t file, TokenCount& count, Problems& findings) {
  return FidlParser{text, file, count, findings}.file();
}

}  // namespace trestle::describe::fidl
