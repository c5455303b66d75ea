#include "bridge/describe/read/fidl/names.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <iterator>
#include <map>
#include <set>
#include <tuple>

#include "bridge/describe/read/copies.hpp"
#include "bridge/describe/read/fidl/keys.hpp"
#include "bridge/documents/problems.hpp"

namespace trestle::describe::fidl {
namespace {

/// Names that are compared when one is not known.
constexpr std::size_t most_hints = 3000;
/// Members that interfaces have of those that they extend, of all interfaces together.
constexpr std::size_t most_inherited = 200'000;
/// Enumerations, or specifications, that extend each other, where a name is looked for.
constexpr std::size_t most_bases = 50;

std::string joined(std::string_view scope, std::string_view name) {
  return scope.empty() || name.empty() ? std::string{scope} + std::string{name}
                                       : fmt::format("{}.{}", scope, name);
}

/// "A, B, C", of many the first ones.
std::string listed(const std::set<std::string, std::less<>>& names) {
  constexpr std::size_t most_names = 20;
  std::string all;
  std::size_t count = 0;
  for (const std::string& name : names) {
    if (++count > most_names) {
      return fmt::format("{} and {} more", all, names.size() - most_names);
    }
    all += (all.empty() ? "" : ", ") + name;
  }
  return all;
}

std::tuple<std::string_view, std::string_view> sort_key(const Node& node) {
  return {node.tag, node.target.text};
}

bool same_values(const Setting& a, const Setting& b) {
  return written(a) == written(b);
}

/// Says once what two elements say of one thing.
/// @param files  their names.
void resolve(std::vector<Setting>& settings, const std::vector<std::string>& files, Problems& findings) {
  std::ranges::stable_sort(settings, {}, [](const Setting& setting) { return setting.key.text; });
  const auto same = [&](const Setting& first, const Setting& second) {
    if (first.key.text != second.key.text) {
      return false;
    }
    if (!same_values(first, second)) {
      const Place& at = first.key.place;
      const std::string where = at.file == second.key.place.file ? fmt::format("in line {}", at.mark.line)
                                                                 : fmt::format("at {}:{}:{}", files[at.file],
                                                                               at.mark.line, at.mark.column);
      findings.error(second.key.place, fmt::format("{} = {} contradicts {} = {} {}", second.key.text,
                                                   written(second), first.key.text, written(first), where));
    }
    return true;
  };
  settings.erase(std::unique(settings.begin(), settings.end(), same), settings.end());
}

void resolve(Node& node, int version, const std::vector<std::string>& files, Problems& findings) {
  node.version = version;
  resolve(node.settings, files, findings);
  for (Node& child : node.children) {
    // "a.b.Types.Mode" is Mode.
    std::string& name = child.target.text;
    if (child.tag != "instance") {
      name.erase(0, name.substr(0, name.find(':')).rfind('.') + 1);
    }
  }
  std::ranges::stable_sort(node.children, {}, sort_key);
  std::vector<Node> once;
  for (Node& child : node.children) {
    if (!once.empty() && child.tag != "instance" && sort_key(once.back()) == sort_key(child)) {
      std::ranges::move(child.settings, std::back_inserter(once.back().settings));
      std::ranges::move(child.children, std::back_inserter(once.back().children));
    } else {
      once.push_back(std::move(child));
    }
  }
  node.children = std::move(once);
  for (Node& child : node.children) {
    resolve(child, version, files, findings);
  }
}

}  // namespace

Names::Names(const Sources& sources, Problems& findings) : sources_{sources}, findings_{findings} {
  for (const FidlSource& source : sources.fidl) {
    declare(source);
  }
  find_lines();
  deploy();
  attach();
}

void Names::declare_once(const std::string& name, Place place, const char* what) {
  const auto [found, is_new] = declared_.emplace(name, place);
  if (!is_new && found->second != place) {
    findings_.error(place,
                    fmt::format("{} {} is declared twice, first in {}:{}", what, documents::quote(name),
                                sources_.names[found->second.file], found->second.mark.line));
  }
}

void Names::declare(const FidlSource& source) {
  for (const CollectionTree& tree : source.tree.collections) {
    Collection& collection = collections_.emplace_back();
    collection.scope = {&source,
                        &tree,
                        joined(source.tree.package, tree.name.text),
                        joined(source.tree.package, tree.name.in_model()),
                        {}};
    const std::string& scope = collection.scope.name;
    (tree.is_interface ? interface_names_ : collection_names_).insert(scope);
    if (tree.is_interface) {
      declare_once(scope, tree.name.place, "the interface");
      interfaces_.emplace(scope, &collection);
    }
    for (const TypeTree& type : tree.types) {
      const std::string name = joined(scope, type.name.text);
      declare_once(name, type.name.place, "the type");
      Declared& declared = types_.emplace_back();
      declared.tree = &type;
      declared.scope = collection.scope;
      types_by_name_.emplace(name, &declared);
      for (std::size_t i = 0; i < type.enumerators.size(); ++i) {
        values_.emplace(joined(name, type.enumerators[i].name.text),
                        Constantlike{nullptr, &declared, i, collection.scope});
      }
    }
    for (const ConstantTree& constant : tree.constants) {
      const std::string name = joined(scope, constant.name.text);
      declare_once(name, constant.name.place, "the constant");
      values_.emplace(name, Constantlike{&constant, nullptr, 0, collection.scope});
    }
  }
}

void Names::find_lines() {
  std::size_t inherited = 0;
  std::map<const CollectionTree*, std::size_t> sizes;
  const auto size_of = [&sizes](const CollectionTree& tree) {
    const auto [known, is_new] = sizes.try_emplace(&tree, 0);
    std::size_t& size = known->second;
    const auto add = [&size](const Notes& notes, const std::vector<Variable>& in,
                             const std::vector<Variable>& out) {
      size += 1 + Copies::of_text(notes);
      for (const std::vector<Variable>* const arguments : {&in, &out}) {
        for (const Variable& argument : *arguments) {
          size += 1 + Copies::of_text(argument.notes);
        }
      }
    };
    if (is_new) {
      for (const AttributeTree& attribute : tree.attributes) {
        add(attribute.value.notes, {}, {});
      }
      for (const MethodTree& method : tree.methods) {
        add(method.notes, method.in, method.out);
        size += method.own_error ? method.own_error->enumerators.size() : 0;
      }
      for (const BroadcastTree& broadcast : tree.broadcasts) {
        add(broadcast.notes, {}, broadcast.out);
      }
    }
    return size;
  };
  bool told = false;
  for (Collection& collection : collections_) {
    std::set<const Collection*> seen;
    const Collection* at = &collection;
    while (at != nullptr) {
      if (!seen.insert(at).second) {
        findings_.error(
            at->scope.in->base.place,
            fmt::format("the interfaces form a cycle: {} extends itself, directly or through others",
                        documents::quote(at->scope.name)));
        break;
      }
      collection.line.insert(collection.line.begin(), at);
      // Not by interface(): looking into what is extended needs what is found here.
      at = at->scope.in->base.empty() ? nullptr : interface(at->scope.in->base, at->scope);
      if (collection.line.size() > 200) {
        findings_.error(collection.scope.in->name.place, "interfaces extend each other more than 200 deep");
        break;
      }
    }
    for (const Collection* const base : collection.line) {
      inherited += base == &collection ? 0 : size_of(*base->scope.in);
    }
    if (inherited > most_inherited) {
      // All of them would be copied.
      if (!told) {
        findings_.error(collection.scope.in->name.place,
                        fmt::format("interfaces have inherited more than {} members and arguments up to here",
                                    most_inherited));
      }
      told = true;
      collection.line = {&collection};
    }
  }
}

void Names::deploy() {
  std::map<std::string, DeclaredKeys, std::less<>> specifications;
  for (const FdeplSource& source : sources_.fdepl) {
    for (const SpecificationTree& specification : source.tree.specifications) {
      const auto [found, is_new] = specifications.try_emplace(
          specification.name.text, DeclaredKeys{specification.name, specification.base.text});
      found->second.keys.insert(specification.keys.begin(), specification.keys.end());
    }
  }
  // A specification and those that it extends, as far as they are here; whether CommonAPI's is among them.
  const auto line_of = [&](std::string name) {
    std::vector<DeclaredKeys*> line;
    while (line.size() < most_bases) {
      const auto found = specifications.find(name);
      if (found != specifications.end()) {
        line.push_back(&found->second);
      }
      if (found == specifications.end() || is_known_specification(name)) {
        break;
      }
      name = found->second.base;
    }
    return std::pair{line, is_known_specification(name)};
  };
  bool first = true;
  for (const FdeplSource& source : sources_.fdepl) {
    bool told = false;
    for (const Node& node : source.tree.deployments) {
      const auto [line, is_known] = line_of(node.specification.text);
      if (!is_known) {
        if (node.specification.text.find("dbus") == std::string::npos) {
          findings_.warning_once(
              "deployments of " + node.specification.text, node.specification.place,
              fmt::format("deployments of {} are left out: they are not of CommonAPI's SOME/IP",
                          documents::quote(node.specification.text)));
        }
        continue;
      }
      if (source.version == 0 && !told) {
        told = true;
        findings_.warning(
            Place{source.file, {}},
            "no import tells which version of CommonAPI's specification is meant; the defaults of "
            "version 2 (CommonAPI-4-SOMEIP_deployment_spec.fdepl) are taken");
      }
      if (first) {
        first = false;
        version_ = source.version == 0 ? 2 : source.version;
      }
      Node copy = node;
      resolve(copy, source.version == 0 ? 2 : source.version, sources_.names, findings_);
      check_keys(copy, line, findings_);
      deploy(copy, source.tree);
    }
  }
  for (const auto& [name, own] : specifications) {
    if (!own.unread.empty()) {
      findings_.warning(
          own.specification.place,
          fmt::format("of the keys that the specification {} declares, these are not known, and "
                      "are left out where deployments have them: {}",
                      documents::quote(name), listed(own.unread)));
    }
  }
  for (auto& [name, node] : deployed_) {
    resolve(node, node.version, sources_.names, findings_);
  }
}

void Names::deploy(const Node& node, const FdeplTree& tree) {
  if (node.tag == "provider" || node.tag == "instance") {
    providers_.push_back(node);
    if (node.tag == "instance") {
      instances_.push_back(&providers_.back());
    }
    for (const Node& child : providers_.back().children) {
      if (child.tag == "instance") {
        instances_.push_back(&child);
      } else {
        findings_.warning(child.place,
                          fmt::format("{} in a provider means nothing, and is left out; expected instance",
                                      documents::quote(child.tag)));
      }
    }
    return;
  }
  if (node.tag != "interface" && node.tag != "typeCollection") {
    findings_.warning(node.place,
                      fmt::format("a deployment for {} means nothing, and is left out; expected interface, "
                                  "typeCollection, provider or instance",
                                  documents::quote(node.tag)));
    return;
  }
  const std::set<std::string, std::less<>>& all =
      node.tag == "interface" ? interface_names_ : collection_names_;
  std::string target = node.target.text;
  if (!all.contains(target)) {
    target = joined(tree.package, node.target.text);
  }
  if (!all.contains(target)) {
    std::vector<std::string> known;
    for (auto name = all.begin(); name != all.end() && known.size() < most_hints && !findings_.full();
         ++name) {
      known.push_back(*name);
    }
    findings_.error(node.target.place,
                    fmt::format("there is no {} {} in the FIDL files{}",
                                node.tag == "interface" ? "interface" : "type collection",
                                documents::quote(node.target.text), hint(node.target.text, known)));
    return;
  }
  const auto [found, is_new] = deployed_.emplace(fmt::format("{} {}", node.tag, target), node);
  if (!is_new) {
    std::ranges::copy(node.settings, std::back_inserter(found->second.settings));
    std::ranges::copy(node.children, std::back_inserter(found->second.children));
  }
}

void Names::attach() {
  for (Collection& collection : collections_) {
    const auto found = deployed_.find(fmt::format(
        "{} {}", collection.scope.in->is_interface ? "interface" : "typeCollection", collection.scope.name));
    collection.node = found == deployed_.end() ? nullptr : &found->second;
    collection.version = collection.node == nullptr ? version_ : collection.node->version;
  }
  static const std::map<Kind, std::string_view> tags{
      {Kind::array, "array"},  {Kind::structure, "struct"},
      {Kind::choice, "union"}, {Kind::enumeration, "enumeration"},
      {Kind::map, "map"},      {Kind::alias, "typedef"}};
  std::map<const CollectionTree*, const Collection*> by_tree;
  for (const Collection& collection : collections_) {
    by_tree[collection.scope.in] = &collection;
  }
  for (Declared& declared : types_) {
    const Collection& collection = *by_tree[declared.scope.in];
    declared.version = collection.version;
    declared.of_all = collection.node;
    declared.node = collection.node == nullptr
                        ? nullptr
                        : collection.node->child(tags.at(declared.tree->kind), declared.tree->name.text);
  }
  // What is deployed has to be there.
  for (const auto& [name, node] : deployed_) {
    const std::string target = name.substr(name.find(' ') + 1);
    for (const Node& child : node.children) {
      const auto is_tag = [&](const auto& tag) { return tag.second == child.tag; };
      if (std::ranges::none_of(tags, is_tag)) {
        continue;
      }
      const auto type = types_by_name_.find(joined(target, child.target.text));
      if (type == types_by_name_.end() || tags.at(type->second->tree->kind) != child.tag) {
        std::vector<std::string> known;
        if (findings_.full()) {
          return;
        }
        for (const Declared& other : types_) {
          if (other.scope.name == target && known.size() < most_hints &&
              tags.at(other.tree->kind) == child.tag) {
            known.push_back(other.tree->name.text);
          }
        }
        findings_.error(child.place, fmt::format("there is no {} {} in {}{}", child.tag,
                                                 documents::quote(child.target.text),
                                                 documents::quote(target), hint(child.target.text, known)));
      }
    }
  }
}

std::vector<std::string> Names::candidates(std::string_view name, const Scope& scope) const {
  std::vector<std::string> all;
  if (!scope.inner.empty()) {
    all.push_back(joined(joined(scope.name, scope.inner), name));
  }
  all.push_back(joined(scope.name, name));
  if (scope.in != nullptr && scope.in->is_interface) {
    const auto own = interfaces_.find(scope.name);
    if (own != interfaces_.end()) {
      for (const Collection* base : own->second->line) {
        all.push_back(joined(base->scope.name, name));
      }
    }
  }
  if (scope.source != nullptr) {
    all.push_back(joined(scope.source->tree.package, name));
    for (const ImportTree& import : scope.source->tree.imports) {
      if (import.names.ends_with(".*")) {
        all.push_back(joined(std::string_view{import.names}.substr(0, import.names.size() - 2), name));
      } else if (!import.names.empty()) {
        // "import a.b.Types": Types.S is a.b.Types.S.
        const std::size_t dot = import.names.rfind('.') + 1;
        const std::string_view first = name.substr(0, name.find('.'));
        if (std::string_view{import.names}.substr(dot) == first) {
          all.push_back(import.names + std::string{name.substr(first.size())});
        }
      }
    }
    all.emplace_back(name);
    std::string_view package = scope.source->tree.package;
    while (!package.empty()) {
      package = package.substr(0, package.rfind('.') == std::string_view::npos ? 0 : package.rfind('.'));
      all.push_back(joined(package, name));
    }
  }
  return all;
}

Declared* Names::type(const Name& name, const Scope& scope) {
  if (name.empty()) {
    return nullptr;  // it has been said that there is none
  }
  for (const std::string& candidate : candidates(name.text, scope)) {
    const auto found = types_by_name_.find(candidate);
    if (found != types_by_name_.end()) {
      return found->second;
    }
  }
  if (findings_.full()) {
    return nullptr;
  }
  std::vector<std::string> known{"Int8",   "UInt8",   "Int16",  "UInt16", "Int32",  "UInt32",    "Int64",
                                 "UInt64", "Boolean", "String", "Float",  "Double", "ByteBuffer"};
  std::string elsewhere;
  const std::string_view last = std::string_view{name.text}.substr(name.text.rfind('.') + 1);
  for (const Declared& declared : types_) {
    if (declared.tree->name.text == last) {
      elsewhere = joined(declared.scope.name, last);
    }
    if (known.size() < most_hints) {
      known.push_back(declared.tree->name.text);
      known.push_back(joined(declared.scope.name, declared.tree->name.text));
      if (!declared.scope.in->name.empty()) {
        known.push_back(joined(declared.scope.in->name.text, declared.tree->name.text));
      }
    }
  }
  findings_.error(name.place,
                  fmt::format("the type {} is not known here{}", documents::quote(name.text),
                              elsewhere.empty() ? hint(name.text, known)
                                                : fmt::format("; did you mean '{}'?", elsewhere)));
  return nullptr;
}

const Collection* Names::interface(const Name& name, const Scope& scope) {
  if (name.empty()) {
    return nullptr;
  }
  // Not by what is extended: that is just being found out.
  for (const std::string& candidate : candidates(name.text, {scope.source, nullptr, scope.name, {}, {}})) {
    const auto found = interfaces_.find(candidate);
    if (found != interfaces_.end()) {
      return found->second;
    }
  }
  std::vector<std::string> known;
  for (const auto& [full, collection] : interfaces_) {
    if (known.size() < most_hints && !findings_.full()) {
      known.push_back(full);
      known.push_back(collection->scope.in->name.text);
    }
  }
  findings_.error(name.place, fmt::format("the interface {} is not known here{}", documents::quote(name.text),
                                          hint(name.text, known)));
  return nullptr;
}

const Constantlike* Names::value(std::string_view name, const Scope& scope) const {
  for (const std::string& candidate : candidates(name, scope)) {
    const auto found = values_.find(candidate);
    const Constantlike* const value = found == values_.end() ? inherited(candidate) : &found->second;
    if (value != nullptr) {
      return value;
    }
  }
  return nullptr;
}

const Constantlike* Names::inherited(const std::string& name) const {
  const std::size_t dot = name.rfind('.');
  if (dot == std::string::npos) {
    return nullptr;
  }
  auto type = types_by_name_.find(name.substr(0, dot));
  for (std::size_t deep = 0; deep < most_bases && type != types_by_name_.end(); ++deep) {
    const Declared& declared = *type->second;
    const std::string_view base = declared.tree->base.text;
    type = types_by_name_.end();
    if (declared.tree->kind != Kind::enumeration || base.empty()) {
      break;
    }
    for (const std::string& candidate : candidates(base, declared.scope)) {
      type = type == types_by_name_.end() ? types_by_name_.find(candidate) : type;
    }
    if (type != types_by_name_.end()) {
      const auto value = values_.find(type->first + name.substr(dot));
      if (value != values_.end()) {
        return &value->second;
      }
    }
  }
  return nullptr;
}

}  // namespace trestle::describe::fidl
