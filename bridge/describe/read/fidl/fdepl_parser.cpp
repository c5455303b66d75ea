#include <fmt/format.h>

#include <algorithm>
#include <tuple>

#include "bridge/describe/fidl_words.hpp"
#include "bridge/describe/read/fidl/fdepl_tree.hpp"

namespace trestle::describe::fidl {
namespace {

class FdeplParser {
 public:
  FdeplParser(std::string_view text, std::uint32_t file, TokenCount& count, Problems& findings)
      : at_{text, file, count, findings} {}
  FdeplTree file();

 private:
  static bool starts_root(const Token& token) {
    return token.is("define") || token.is("specification") || token.is("import") || token.is("package");
  }
  [[nodiscard]] bool is_one_of(std::initializer_list<std::string_view> words) const {
    return std::ranges::any_of(words, [&](std::string_view word) { return at_.at(word); });
  }
  void import_line(FdeplTree& file);
  void specification(FdeplTree& file);
  void declarations(SpecificationTree& specification);
  void deployment(FdeplTree& file);
  /// What stands between the braces of an element, which are taken too.
  void body(Node& node, int deep);
  void item(Node& node, int deep);
  void child(Node& node, int deep);
  void overwrite(Node& node, int deep);
  void setting(Node& node);
  SettingValue value();

  Cursor at_;
};

FdeplTree FdeplParser::file() {
  FdeplTree file;
  if (at_.take_if("package")) {
    file.package = at_.dotted("the name of a package").text;
  }
  while (!at_.at_end() && !at_.findings().full()) {
    if (at_.lost()) {
      at_.recover(0, starts_root);
      if (at_.at("}")) {
        at_.take();
      }
    } else if (at_.at("import")) {
      import_line(file);
    } else if (at_.at("specification")) {
      specification(file);
    } else if (at_.at("define")) {
      deployment(file);
    } else {
      at_.fail("'import', 'specification' or 'define'");
      at_.take();
    }
  }
  return file;
}

void FdeplParser::import_line(FdeplTree& file) {
  ImportTree import{.place = at_.here()};
  at_.take();
  if (at_.at(Token::Kind::string)) {
    import.file = unquoted(at_.take().text);
  } else {
    import.names = at_.dotted("the name of a file in quotes, or of a specification").text;
  }
  if (!at_.lost()) {
    file.imports.push_back(std::move(import));
  }
}

void FdeplParser::specification(FdeplTree& file) {
  at_.take();
  SpecificationTree specification;
  specification.name = at_.dotted("the name of a specification");
  if (at_.take_if("extends")) {
    specification.base = at_.dotted("the name of a specification");
  }
  if (at_.expect("{", "before the keys of a specification")) {
    declarations(specification);
  }
  if (!specification.name.empty()) {
    file.specifications.push_back(std::move(specification));
  }
}

/// Keys are "NAME : type (flags) ;" within "for HOST { … }". The types are not needed.
void FdeplParser::declarations(SpecificationTree& specification) {
  const int depth = at_.depth();
  while (!at_.at_end() && !(at_.at("}") && at_.depth() == depth)) {
    if (at_.peek().kind == Token::Kind::word && at_.peek(1).is(":") && !at_.peek().is("default")) {
      specification.keys.emplace_back(at_.peek().text);
    }
    at_.take();
  }
  at_.expect("}", "at the end of a specification");
}

void FdeplParser::deployment(FdeplTree& file) {
  Node node{.place = at_.here()};
  at_.take();
  node.specification = at_.dotted("the name of a deployment specification");
  at_.expect("for", "behind the name of the specification");
  if (!at_.at(Token::Kind::word)) {
    at_.fail("'interface', 'typeCollection', 'provider' or 'instance'");
    return;
  }
  node.tag = at_.take().text;
  const bool needs_target = node.tag == "interface" || node.tag == "typeCollection" || node.tag == "instance";
  if (needs_target || (at_.at(Token::Kind::word) && !at_.at("as"))) {
    node.target = at_.dotted("the name of what is deployed");
  }
  if (needs_target && node.target.empty()) {
    return;
  }
  if (at_.take_if("as")) {
    node.alias = at_.dotted("a name");
  } else if (node.tag == "provider" && !node.target.empty()) {
    at_.findings().warning(
        node.target.place,
        fmt::format("Franca wants 'provider as {0}', and refuses 'provider {0}'; read all the same",
                    node.target.text));
    node.alias = node.target;
  }
  body(node, 0);
  file.deployments.push_back(std::move(node));
}

void FdeplParser::body(Node& node, int deep) {
  if (deep > deepest_node) {
    at_.fail(fmt::format("elements that are nested at most {} deep", deepest_node));
    return;
  }
  if (!at_.expect("{", "before the settings of an element")) {
    return;
  }
  const int depth = at_.depth();
  while (!at_.at_end() && !at_.findings().full() && at_.depth() >= depth && !at_.at("}")) {
    item(node, deep);
    if (at_.lost()) {
      at_.recover(depth, [](const Token& token) {
        return starts_root(token) || (token.kind == Token::Kind::word && token.text.starts_with("SomeIp")) ||
               token.is("attribute") || token.is("method") || token.is("broadcast") || token.is("struct");
      });
      if (starts_root(at_.peek())) {
        at_.reset_depth();
        return;
      }
    }
  }
  if (at_.depth() >= depth) {
    at_.expect("}", "at the end of an element");
  }
}

void FdeplParser::item(Node& node, int deep) {
  if (at_.take_if(",")) {
    return;
  }
  if (at_.at("#")) {
    overwrite(node, deep);
  } else if (at_.at("use") && at_.peek(1).kind == Token::Kind::word) {
    at_.take();
    node.uses.push_back(at_.dotted("the name of a deployment"));
  } else if (at_.at(Token::Kind::word) && at_.peek(1).is("=")) {
    setting(node);
  } else if (at_.at(Token::Kind::word)) {
    child(node, deep);
  } else {
    at_.fail("'}', a key and '=', or an element with settings");
    at_.take();
  }
}

void FdeplParser::overwrite(Node& node, int deep) {
  Node overwrite{.tag = "#",
                 .place = at_.here(),
                 .within_overwrite = node.within_overwrite || node.tag.starts_with('#')};
  at_.take();
  if (is_one_of({"struct", "union", "enumeration"})) {
    overwrite.tag += at_.take().text;
  } else if (!at_.at("{")) {
    at_.fail("'{', 'struct', 'union' or 'enumeration' behind '#'");
    return;
  }
  body(overwrite, deep + 1);
  node.children.push_back(std::move(overwrite));
}

void FdeplParser::child(Node& node, int deep) {
  Node child{.place = at_.here(), .within_overwrite = node.within_overwrite || node.tag.starts_with('#')};
  const bool is_map = node.tag == "map";
  const bool is_call = node.tag == "method" || node.tag == "broadcast";
  const bool has_types = node.tag == "interface" || node.tag == "typeCollection";
  if ((is_map && is_one_of({"key", "value"})) || (is_call && is_one_of({"in", "out"}))) {
    child.tag = at_.take().text;
  } else if (has_types || at_.peek(1).kind == Token::Kind::word) {
    child.tag = at_.take().text;
    if (at_.at(Token::Kind::word) && !(at_.at("as") && at_.peek(1).kind == Token::Kind::word)) {
      child.target = at_.dotted("a name");
      if (!child.target.escaped && std::ranges::binary_search(fdepl_keywords(), child.target.text)) {
        at_.findings().warning(
            child.target.place,
            fmt::format("'{0}' is a keyword and should be written ^{0}", child.target.text));
      }
      if (at_.take_if(":")) {
        child.target.text += ":" + at_.dotted("a selector").text;
      }
    }
    if (at_.take_if("as")) {
      child.alias = at_.dotted("a name");
    }
  } else {
    child.target = at_.name("the name of an element", fdepl_keywords());
    while (at_.at(".") && !at_.lost()) {
      at_.take();
      child.target.text = at_.dotted("a name").text;  // "Struct.field" names the field
    }
  }
  body(child, deep + 1);
  node.children.push_back(std::move(child));
}

void FdeplParser::setting(Node& node) {
  Setting setting;
  const Token key = at_.take();
  setting.key = {std::string{key.text}, at_.place(key), key.escaped, {}};
  at_.take();
  if (at_.take_if("{")) {
    setting.list = true;
    while (!at_.lost() && !at_.at("}")) {
      setting.values.push_back(value());
      if (!at_.take_if(",") && !at_.at("}")) {
        at_.fail("',' or '}' in a list of values");
      }
    }
    at_.expect("}", "at the end of a list of values");
  } else {
    setting.values.push_back(value());
  }
  if (!at_.lost()) {
    node.settings.push_back(std::move(setting));
  }
}

SettingValue FdeplParser::value() {
  SettingValue value{.place = at_.here()};
  if (at_.at(Token::Kind::string)) {
    value.kind = SettingValue::Kind::text;
    value.text = unquoted(at_.take().text);
  } else if (at_.at("true") || at_.at("false")) {
    value.kind = SettingValue::Kind::truth;
    value.text = at_.take().text;
  } else if (at_.at(Token::Kind::number) || at_.at("-")) {
    value.number = at_.whole("a whole number").value_or(0);
    value.text = fmt::format("{}", value.number);
  } else if (at_.take_if("&")) {
    value.kind = SettingValue::Kind::reference;
    value.text = at_.dotted("the name of an interface").text;
  } else {
    value.kind = SettingValue::Kind::word;
    value.text = at_.dotted("a value").text;
  }
  return value;
}

}  // namespace

const Setting* Node::setting(std::string_view key) const {
  const auto found = std::ranges::lower_bound(
      settings, key, {}, [](const Setting& one) -> std::string_view { return one.key.text; });
  return found == settings.end() || found->key.text != key ? nullptr : &*found;
}

const Node* Node::child(std::string_view wanted, std::string_view name) const {
  using Key = std::tuple<std::string_view, std::string_view>;
  const auto found = std::ranges::lower_bound(children, Key{wanted, name}, {}, [](const Node& node) {
    return Key{node.tag, node.target.text};
  });
  return found == children.end() || found->tag != wanted || found->target.text != name ? nullptr : &*found;
}

const Node* Node::overwrite() const {
  const auto found =
      std::ranges::find_if(children, [](const Node& node) { return node.tag.starts_with('#'); });
  return found == children.end() ? nullptr : &*found;
}

FdeplTree parse_fdepl(std::string_view text, std::uint32_t file, TokenCount& count, Problems& findings) {
  return FdeplParser{text, file, count, findings}.file();
}

}  // namespace trestle::describe::fidl
