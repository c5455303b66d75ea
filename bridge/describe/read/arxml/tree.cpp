#include "bridge/describe/read/arxml/tree.hpp"

#include <expat.h>

#include <algorithm>
#include <array>
#include <cstdint>
#include <limits>
#include <memory>

#include "bridge/describe/join.hpp"
#include "bridge/messages/types/characters.hpp"

namespace trestle::describe::arxml {

namespace {

// Since 2.9 expat has these names for numbers of 64 bits, and warns of the others.
#if XML_MAJOR_VERSION == 2 && XML_MINOR_VERSION < 9
constexpr auto XML_GetCurrentLineNumber64 = XML_GetCurrentLineNumber;
constexpr auto XML_GetCurrentColumnNumber64 = XML_GetCurrentColumnNumber;
constexpr auto XML_GetCurrentByteIndex64 = XML_GetCurrentByteIndex;
#endif

/// Deeper files do not exist; the deepest elements of real ones are about 40 deep.
constexpr std::size_t max_depth = 120;
constexpr std::size_t text_chunk_bytes = 1U << 18U;

[[nodiscard]] std::string_view without_prefix(std::string_view name) noexcept {
  const std::size_t colon = name.find(':');
  return colon == std::string_view::npos ? name : name.substr(colon + 1);
}

/// Elements of text with markup in it.
[[nodiscard]] constexpr bool has_markup(Tag tag) noexcept {
  return tag == "L-2"_tag || tag == "L-4"_tag;
}

/// Elements of which each part that is not read is told once: what they say becomes messages, or who offers
/// and wants what.
constexpr std::array told_elements{
    "AP-SOMEIP-TRANSFORMATION-PROPS"_tag,
    "ARGUMENT-DATA-PROTOTYPE"_tag,
    "CLIENT-SERVER-OPERATION"_tag,
    "CONSUMED-EVENT-GROUP"_tag,
    "CONSUMED-SERVICE-INSTANCE"_tag,
    "EVENT-HANDLER"_tag,
    "FIELD"_tag,
    "GET"_tag,
    "INITIAL-FIND-BEHAVIOR"_tag,
    "INITIAL-OFFER-BEHAVIOR"_tag,
    "NOTIFIER"_tag,
    "PROVIDED-SERVICE-INSTANCE"_tag,
    "PROVIDED-SOMEIP-SERVICE-INSTANCE"_tag,
    "REQUIRED-SOMEIP-SERVICE-INSTANCE"_tag,
    "SERVICE-INTERFACE"_tag,
    "SET"_tag,
    "SOMEIP-EVENT-DEPLOYMENT"_tag,
    "SOMEIP-EVENT-GROUP"_tag,
    "SOMEIP-FIELD-DEPLOYMENT"_tag,
    "SOMEIP-METHOD-DEPLOYMENT"_tag,
    "SOMEIP-PROVIDED-EVENT-GROUP"_tag,
    "SOMEIP-REQUIRED-EVENT-GROUP"_tag,
    "SOMEIP-SD-CLIENT-EVENT-GROUP-TIMING-CONFIG"_tag,
    "SOMEIP-SD-CLIENT-SERVICE-INSTANCE-CONFIG"_tag,
    "SOMEIP-SD-SERVER-SERVICE-INSTANCE-CONFIG"_tag,
    "SOMEIP-SERVICE-DISCOVERY"_tag,
    "SOMEIP-SERVICE-INSTANCE-TO-MACHINE-MAPPING"_tag,
    "SOMEIP-SERVICE-INTERFACE-DEPLOYMENT"_tag,
    "SOMEIP-TRANSFORMATION-DESCRIPTION"_tag,
    "SOMEIP-TRANSFORMATION-I-SIGNAL-PROPS-CONDITIONAL"_tag,
};
constexpr auto is_told = [] {
  std::array<bool, vocabulary.size()> told{};
  for (const Tag tag : told_elements) {
    told[static_cast<std::size_t>(tag)] = true;
  }
  return told;
}();
/// Parts that are for other tools, or say how a program is built or started.
constexpr std::array other_matters{
    std::string_view{"ADMIN-DATA"},
    std::string_view{"AUTO-AVAILABLE"},
    std::string_view{"AUTO-REQUIRE"},
    std::string_view{"BLUEPRINT-POLICYS"},
    std::string_view{"DIAG-ARG-INTEGRITY"},
    std::string_view{"INTRODUCTION"},
    std::string_view{"IS-SERVICE"},
    std::string_view{"LONG-NAME"},
    std::string_view{"SERVER-ARGUMENT-IMPL-POLICY"},
    std::string_view{"SERVICE-KIND"},
    std::string_view{"SHORT-NAME-FRAGMENTS"},
    std::string_view{"SHORT-NAME-PATTERN"},
    std::string_view{"TYPE-BLUEPRINTS"},
};

[[nodiscard]] bool contains(std::string_view text, std::string_view part) noexcept {
  return text.find(part) != std::string_view::npos;
}

[[nodiscard]] std::string lower(std::string_view text) {
  std::string out{text};
  for (char& letter : out) {
    letter = letter >= 'A' && letter <= 'Z' ? static_cast<char>(letter - 'A' + 'a') : letter;
  }
  return out;
}

}  // namespace

const Node* Node::child(Tag wanted) const noexcept {
  for (const Node* node = first_child; node != nullptr; node = node->next) {
    if (node->tag == wanted) {
      return node;
    }
  }
  return nullptr;
}

std::string_view Node::child_text(Tag wanted) const noexcept {
  const Node* const found = child(wanted);
  return found == nullptr ? std::string_view{} : found->text;
}

const Node* Node::above(Tag wanted) const noexcept {
  for (const Node* node = parent; node != nullptr; node = node->parent) {
    if (node->tag == wanted) {
      return node;
    }
  }
  return nullptr;
}

namespace {

void append(Node& parent, Node& child) noexcept {
  child.parent = &parent;
  child.next = nullptr;
  if (parent.last_child == nullptr) {
    parent.first_child = &child;
  } else {
    parent.last_child->next = &child;
  }
  parent.last_child = &child;
}

}  // namespace

/// What expat calls for one file.
class Handlers {
 public:
  Handlers(Tree& tree, XML_Parser parser, std::uint16_t file) : tree_{tree}, parser_{parser}, file_{file} {
    XML_SetUserData(parser, this);
    XML_SetElementHandler(parser, &start, &end);
    XML_SetCharacterDataHandler(parser, &characters);
    XML_SetStartDoctypeDeclHandler(parser, &doctype);
    XML_SetUnknownEncodingHandler(parser, &other_encoding, nullptr);
  }

  [[nodiscard]] Place here() const noexcept {
    constexpr std::uint64_t most = std::numeric_limits<int>::max();
    return {file_,
            {static_cast<int>(std::min<std::uint64_t>(XML_GetCurrentLineNumber64(parser_), most)),
             static_cast<int>(std::min<std::uint64_t>(XML_GetCurrentColumnNumber64(parser_) + 1, most))}};
  }
  /// What is wrong where expat stopped, and what was expected.
  [[nodiscard]] std::string text_of(XML_Error error) const {
    const std::string open = current_ == nullptr
                                 ? "AUTOSAR"
                                 : (skipped_from_ > 0 ? "an element in " : "") +
                                       std::string{to_string(current_->tag)} + ", which begins on line " +
                                       std::to_string(current_->line) + ",";
    switch (error) {
      case XML_ERROR_NO_ELEMENTS:
        return depth_ == 0 ? "the file is empty, and XML with the top element AUTOSAR was expected"
                           : "the file ends here, and the end of " + open + " was expected";
      case XML_ERROR_UNCLOSED_TOKEN:
        return "the file ends within the tag or comment that begins here";
      case XML_ERROR_TAG_MISMATCH:
        return "this tag ends another element, and the end of " + open + " was expected";
      default:
        return std::string{"this is not well-formed XML: "} + XML_ErrorString(error) +
               (depth_ == 0 && error != XML_ERROR_JUNK_AFTER_DOC_ELEMENT
                    ? "; the top element AUTOSAR was expected"
                    : "");
    }
  }

  [[nodiscard]] bool stopped() const noexcept { return stopped_; }
  /// What is said once for the whole file.
  void finish() {
    if (variants_ > 0) {
      tree_.problems_.warning(first_variant_,
                              std::to_string(variants_) +
                                  " elements of this file have a VARIATION-POINT; each of them is read as if "
                                  "its variant were chosen");
    }
  }

 private:
  static void XMLCALL start(void* self, const XML_Char* name, const XML_Char** attributes) {
    static_cast<Handlers*>(self)->on_start(name, attributes);
  }
  static void XMLCALL end(void* self, const XML_Char* /*name*/) { static_cast<Handlers*>(self)->on_end(); }
  static void XMLCALL characters(void* self, const XML_Char* text, int size) {
    static_cast<Handlers*>(self)->on_text({text, static_cast<std::size_t>(size)});
  }
  /// Other spellings of encodings that expat knows, and Windows' of western languages.
  static int XMLCALL other_encoding(void* /*self*/, const XML_Char* name, XML_Encoding* encoding) {
    // Of Windows-1252 what ISO 8859-1 has controls for; -1: nothing.
    static constexpr std::array<int, 32> windows{
        0x20ac, -1,     0x201a, 0x0192, 0x201e, 0x2026, 0x2020, 0x2021, 0x02c6, 0x2030, 0x0160,
        0x2039, 0x0152, -1,     0x017d, -1,     -1,     0x2018, 0x2019, 0x201c, 0x201d, 0x2022,
        0x2013, 0x2014, 0x02dc, 0x2122, 0x0161, 0x203a, 0x0153, -1,     0x017e, 0x0178};
    const std::string known = lower(name);
    const bool is_ascii = known == "ascii";
    const bool is_windows = known == "windows-1252" || known == "cp1252";
    if (!is_ascii && !is_windows && known != "latin1" && known != "latin-1" && known != "iso8859-1") {
      return XML_STATUS_ERROR;
    }
    for (int byte = 0; byte < 256; ++byte) {
      encoding->map[byte] = byte < 128 || !is_ascii ? byte : -1;
    }
    if (is_windows) {
      std::ranges::copy(windows, &encoding->map[0x80]);
    }
    encoding->data = nullptr;
    encoding->convert = nullptr;
    encoding->release = nullptr;
    return XML_STATUS_OK;
  }
  static void XMLCALL doctype(void* self, const XML_Char* /*name*/, const XML_Char* /*system*/,
                              const XML_Char* /*public_id*/, int /*internal*/) {
    // Entities of a DTD are how a small file becomes a large one, and how it reads other files.
    static_cast<Handlers*>(self)->stop("ARXML has no DTD, so this one is refused");
  }

  void stop(std::string text) {
    if (!stopped_) {
      tree_.problems_.error(here(), std::move(text));
      stopped_ = true;
      XML_StopParser(parser_, XML_FALSE);
    }
  }

  void on_start(std::string_view name, const XML_Char** attributes) {
    if (stopped_) {
      return;
    }
    if (++depth_ > max_depth) {
      stop("elements are nested more than " + std::to_string(max_depth) + " deep");
      return;
    }
    if (skipped_from_ > 0) {
      return;
    }
    name = without_prefix(name);
    if (current_ != nullptr && current_->tag == "SHORT-NAME"_tag) {
      tree_.problems_.error(here(),
                            "an element stands in a SHORT-NAME, and a name was expected: it is ignored");
      skipped_from_ = depth_;
      return;
    }
    const std::size_t index = index_of(name);
    if (depth_ == 1 && !accept_top(name, attributes)) {
      return;
    }
    if (index == vocabulary.size()) {
      // In text, markup is passed through.
      if (current_ == nullptr || !has_markup(current_->tag)) {
        tell_unread(name);
        skipped_from_ = depth_;
      }
      return;
    }
    const Tag tag{static_cast<std::uint16_t>(index)};
    if (tag == "VARIATION-POINT"_tag) {
      if (variants_++ == 0) {
        first_variant_ = here();
      }
      skipped_from_ = depth_;
      return;
    }
    open(tag, attributes);
  }

  void tell_unread(std::string_view name) {
    if (current_ == nullptr || !is_told.at(static_cast<std::size_t>(current_->tag)) ||
        std::ranges::find(other_matters, name) != other_matters.end()) {
      return;
    }
    const std::string holder{to_string(current_->tag)};
    tree_.problems_.warning_once(holder + ' ' + std::string{name}, here(),
                                 documents::printable(name.substr(0, 80)) + " of " + holder +
                                     " is not read, here and wherever else it stands");
  }

  [[nodiscard]] bool accept_top(std::string_view name, const XML_Char** attributes) {
    if (name != "AUTOSAR") {
      stop("the top element is " + std::string{name} + ", and AUTOSAR was expected");
      return false;
    }
    std::string_view space;
    std::string_view schema;
    for (; *attributes != nullptr; attributes += 2) {
      const std::string_view key = attributes[0];
      if (key.starts_with("xmlns") && contains(attributes[1], "autosar")) {
        space = attributes[1];
      } else if (without_prefix(key) == "schemaLocation") {
        schema = attributes[1];
      }
    }
    if (contains(space, "autosar.org/3") || contains(space, "autosar.org/2") ||
        contains(space, "schema/r3") || contains(space, "schema/r2")) {
      stop("the file is of AUTOSAR " + std::string{space} + "; http://autosar.org/schema/r4.0 was expected");
      return false;
    }
    if (!contains(space, "autosar.org/schema/r4")) {
      tree_.problems_.warning(here(),
                              "the namespace is not http://autosar.org/schema/r4.0; read as if it were");
    } else if (!contains(lower(schema), "autosar_")) {
      tree_.problems_.warning(here(), "xsi:schemaLocation names no AUTOSAR_….xsd; read as AUTOSAR 4");
    }
    return true;
  }

  void open(Tag tag, const XML_Char** attributes) {
    if (tree_.nodes_.size() >= tree_.options_.max_elements) {
      stop("there are more than " + std::to_string(tree_.options_.max_elements) +
           " elements of interest; further ones are not read");
      return;
    }
    Node& node = tree_.nodes_.emplace_back();
    const Place place = here();
    node.tag = tag;
    node.file = file_;
    node.line = place.mark.line;
    node.column = place.mark.column;
    for (; *attributes != nullptr; attributes += 2) {
      const std::string_view key = attributes[0];
      if (key == "BASE") {
        tree_.bases_.emplace(&node, attributes[1]);
      } else if (key == "INTERVAL-TYPE") {
        node.open_interval = std::string_view{attributes[1]} == "OPEN";
      } else if (key == "L") {
        node.english = std::string_view{attributes[1]} == "EN";
      } else if (key == "BINDING-TIME") {
        node.formula = true;
      }
    }
    if (current_ != nullptr) {
      if (tag == "SHORT-NAME"_tag) {
        before_name_ = current_->last_child;
      }
      append(*current_, node);
    } else {
      tree_.tops_.push_back(&node);
    }
    current_ = &node;
    text_.clear();
  }

  void on_end() {
    if (stopped_) {
      return;
    }
    const std::size_t depth = depth_--;
    if (skipped_from_ > 0) {
      if (skipped_from_ == depth) {
        skipped_from_ = 0;
      }
      return;
    }
    // Markup that was passed through has no node.
    if (current_ == nullptr || (has_markup(current_->tag) && depth > depth_of(current_))) {
      return;
    }
    close(*current_);
  }

  /// Nodes are exactly as deep as their elements: an element without a node skips all that is in it.
  [[nodiscard]] static std::size_t depth_of(const Node* node) noexcept {
    std::size_t depth = 0;
    for (; node != nullptr; node = node->parent) {
      ++depth;
    }
    return depth;
  }

  void close(Node& node) {
    Node* const parent = node.parent;
    const std::string_view text = messages::trimmed(text_, " \t\r\n");
    if (!text.empty() && node.first_child == nullptr) {
      if (tree_.text_bytes_ + text.size() > tree_.options_.max_text_bytes) {
        stop("there are more than " + std::to_string(tree_.options_.max_text_bytes) + " bytes of text");
        return;
      }
      node.text = tree_.keep(text);
    }
    text_.clear();
    current_ = parent;
    if (node.tag == "SHORT-NAME"_tag && parent != nullptr) {
      take_name(*parent, node);
    }
  }

  /// A name is no child of its own, to keep the tree small.
  void take_name(Node& parent, Node& name) {
    if (parent.tag == "SUB-ELEMENTS"_tag || parent.tag == "ELEMENTS"_tag || parent.tag == "AR-PACKAGES"_tag) {
      tree_.problems_.warning(name.place(), "a SHORT-NAME is not expected in " +
                                                std::string{to_string(parent.tag)} + "; it is ignored");
    } else if (name.text.size() > tree_.options_.max_name_bytes) {
      stop("this SHORT-NAME has " + std::to_string(name.text.size()) + " bytes; expected at most " +
           std::to_string(tree_.options_.max_name_bytes));
    } else if (parent.name.empty()) {
      if (is_spoilt(name.text)) {
        tree_.problems_.error(
            name.place(),
            "a line end or another control character is in this SHORT-NAME; expected letters, "
            "digits and '_'");
      }
      parent.name = name.text;
    }
    // It is the last node that was made, and the last child: there are no elements in it.
    (before_name_ == nullptr ? parent.first_child : before_name_->next) = nullptr;
    parent.last_child = before_name_;
    tree_.nodes_.pop_back();
  }

  /// Names stand in paths, in other files and in messages of one line.
  [[nodiscard]] static bool is_spoilt(std::string_view name) noexcept {
    return std::ranges::any_of(name,
                               [](char c) { return static_cast<unsigned char>(c) < 0x20 || c == '\x7f'; });
  }

  void on_text(std::string_view text) {
    if (!stopped_ && skipped_from_ == 0 && current_ != nullptr && current_->first_child == nullptr) {
      if (text_.size() + text.size() > tree_.options_.max_text_bytes) {
        stop("the text of this element is too long");
        return;
      }
      text_ += text;
    }
  }

  Tree& tree_;
  XML_Parser parser_;
  std::uint16_t file_;
  Node* current_ = nullptr;
  Node* before_name_ = nullptr;  ///< the child of current_ before its SHORT-NAME
  std::string text_{};
  std::size_t depth_ = 0;
  std::size_t skipped_from_ = 0;  ///< depth of the element that is skipped with all that is in it; 0: none
  std::size_t variants_ = 0;
  Place first_variant_{};
  bool stopped_ = false;
};

std::string_view Tree::keep(std::string_view text) {
  if (text_.empty() || text_.back().capacity() - text_.back().size() < text.size()) {
    text_.emplace_back().reserve(std::max(text_chunk_bytes, text.size()));
  }
  std::string& chunk = text_.back();
  const std::size_t at = chunk.size();
  chunk += text;  // never moves: there is room
  text_bytes_ += text.size();
  return std::string_view{chunk}.substr(at);
}

bool Tree::add(std::istream& stream, std::uint16_t file) {
  const std::unique_ptr<XML_ParserStruct, decltype(&XML_ParserFree)> parser{XML_ParserCreate(nullptr),
                                                                            &XML_ParserFree};
  if (!parser) {
    problems_.error(Place{file, {}}, "no memory for reading XML");
    return false;
  }
  Handlers handlers{*this, parser.get(), file};
  constexpr int buffer_bytes = 1 << 18;
  std::size_t bytes = 0;
  for (bool last = false; !last;) {
    void* const buffer = XML_GetBuffer(parser.get(), buffer_bytes);
    if (buffer == nullptr) {
      problems_.error(handlers.here(), "no memory for reading XML");
      return false;
    }
    stream.read(static_cast<char*>(buffer), buffer_bytes);
    last = !stream.good();
    if (stream.bad()) {
      problems_.error(handlers.here(), "the file cannot be read any further");
      return false;
    }
    if (XML_ParseBuffer(parser.get(), static_cast<int>(stream.gcount()), last ? 1 : 0) != XML_STATUS_OK) {
      if (!handlers.stopped()) {
        problems_.error(handlers.here(), handlers.text_of(XML_GetErrorCode(parser.get())));
      }
      return false;
    }
    // What expat has not told yet is within one tag.
    bytes += static_cast<std::size_t>(stream.gcount());
    const auto told =
        static_cast<std::size_t>(std::max<std::int64_t>(XML_GetCurrentByteIndex64(parser.get()), 0));
    if (!last && bytes - told > options_.max_tag_bytes) {
      problems_.error(handlers.here(), "this tag or comment has more than " +
                                           std::to_string(options_.max_tag_bytes) +
                                           " bytes, or does not end; expected shorter ones");
      return false;
    }
  }
  handlers.finish();
  return true;
}

// --- joining ----------------------------------------------------------------------------------------------

namespace {

/// Elements without a name that are there once, and hold others.
[[nodiscard]] bool is_container(const Node& node) noexcept {
  return node.name.empty() && node.text.empty() && to_string(node.tag).ends_with('S') &&
         node.tag != "SOMEIP-EVENT-PROPS"_tag && node.tag != "SOMEIP-METHOD-PROPS"_tag;
}

/// Takes the children away, as a list.
[[nodiscard]] Node* take_children(Node& node) noexcept {
  Node* const first = node.first_child;
  node.first_child = nullptr;
  node.last_child = nullptr;
  return first;
}

}  // namespace

/// The children of an element by what makes them one with others.
struct Tree::Siblings {
  std::unordered_map<std::string_view, Node*> packages{};
  std::unordered_map<std::string_view, Node*> names{};  ///< of others, which may have that of a package
  std::unordered_map<std::string_view, Node*> texts{};
  std::unordered_map<std::uint16_t, Node*> containers{};

  [[nodiscard]] std::unordered_map<std::string_view, Node*>& named(Tag tag) noexcept {
    return tag == "AR-PACKAGE"_tag ? packages : names;
  }
  void add(Node& node) {
    if (!node.name.empty()) {
      named(node.tag).try_emplace(node.name, &node);
    } else if (is_container(node)) {
      containers.try_emplace(static_cast<std::uint16_t>(node.tag), &node);
    } else if (node.first_child == nullptr) {
      texts.try_emplace(node.text, &node);
    }
  }
};

void Tree::absorb(Node& into, Node& child, Siblings& siblings) {
  if (!child.name.empty()) {
    const auto& named = siblings.named(child.tag);
    const auto there = named.find(child.name);
    if (there != named.end() && there->second->tag == child.tag &&
        (child.tag == "AR-PACKAGE"_tag || there->second->file != child.file)) {
      merge_children(*there->second, child);
      return;
    }
  } else if (is_container(child)) {
    const auto there = siblings.containers.find(static_cast<std::uint16_t>(child.tag));
    if (there != siblings.containers.end()) {
      merge_children(*there->second, child);
      return;
    }
  } else if (child.first_child == nullptr) {
    const auto there = siblings.texts.find(child.text);
    if (there != siblings.texts.end() && there->second->tag == child.tag &&
        there->second->file != child.file) {
      return;  // said in both files
    }
  }
  append(into, child);
  siblings.add(child);
  if (child.tag == "AR-PACKAGE"_tag || child.tag == "AR-PACKAGES"_tag) {
    // Also a single file may have a package in several pieces.
    merge_children(child, child);
  }
}

void Tree::merge_children(Node& into, Node& from) {
  Node* child = take_children(from);
  Siblings siblings;
  for (Node* node = into.first_child; node != nullptr; node = node->next) {
    siblings.add(*node);
  }
  while (child != nullptr) {
    Node& moved = *child;
    child = child->next;
    if (&into == &from && into.tag == "AR-PACKAGE"_tag && moved.tag != "AR-PACKAGES"_tag) {
      append(into, moved);
    } else {
      absorb(into, moved, siblings);
    }
  }
}

void Tree::join() {
  root_.tag = "AUTOSAR"_tag;
  for (Node* const top : tops_) {
    merge_children(root_, *top);
  }
  by_tag_.resize(vocabulary.size());
  index(root_, &root_, 0);
}

void Tree::index(Node& node, Node* named, std::size_t path_bytes) {
  for (Node* child = node.first_child; child != nullptr; child = child->next) {
    const std::size_t bytes = path_bytes + child->name.size() + (child->name.empty() ? 0 : 1);
    if (bytes > options_.max_path_bytes) {
      problems_.error(child->place(), "the path of this element has " + std::to_string(bytes) +
                                          " bytes; expected at most " +
                                          std::to_string(options_.max_path_bytes));
      continue;
    }
    by_tag_[static_cast<std::size_t>(child->tag)].push_back(child);
    if (child->tag == "REFERENCE-BASES"_tag) {
      reference_bases_.emplace(&node, child);
    }
    Node* inner = named;
    if (!child->name.empty()) {
      inner = child;
      const auto [there, is_new] = names_.try_emplace(Key{named, child->name}, child);
      if (!is_new) {
        more_names_[Key{named, child->name}].push_back(child);
        if (there->second->tag == child->tag && node.tag == "ELEMENTS"_tag) {
          problems_.warning(child->place(), path(child) + " is declared twice; references mean the one at " +
                                                to_string(model_, there->second->place()));
        }
      }
    }
    index(*child, inner, bytes);
  }
}

// --- paths ------------------------------------------------------------------------------------------------

std::string Tree::path(const Node* node) {
  std::vector<std::string_view> names;
  for (; node != nullptr; node = node->parent) {
    if (!node->name.empty()) {
      names.push_back(node->name);
    }
  }
  std::string path;
  for (auto name = names.rbegin(); name != names.rend(); ++name) {
    path += '/';
    path += *name;
  }
  return path;
}

std::string Tree::scope(const Node& node) {
  return path(node.parent);
}

const Node* Tree::find(const Node* from, std::string_view path) const {
  int steps = 0;
  return find(from, path, steps);
}

/// A package and another element may have one name: then the one is meant that the rest of the path is in.
const Node* Tree::find(const Node* from, std::string_view path, int& steps) const {
  constexpr int max_steps = 1000;
  if (from == nullptr || path.empty() || ++steps > max_steps) {
    return steps > max_steps ? nullptr : from;
  }
  const std::size_t slash = path.find('/');
  const Key key{from, path.substr(0, slash)};
  const std::string_view rest = slash == std::string_view::npos ? std::string_view{} : path.substr(slash + 1);
  const auto first = names_.find(key);
  const Node* found = first == names_.end() ? nullptr : find(first->second, rest, steps);
  if (found == nullptr && first != names_.end()) {
    const auto others = more_names_.find(key);
    if (others != more_names_.end()) {
      for (const Node* const other : others->second) {
        found = found == nullptr ? find(other, rest, steps) : found;
      }
    }
  }
  return found;
}

const Node* Tree::guess(const Node& reference) const {
  const std::string_view path = reference.text;
  // By a base of one of the packages around it.
  const auto base = bases_.find(&reference);
  for (const Node* node = &reference; node != nullptr; node = node->parent) {
    const auto list = reference_bases_.find(node);
    if (list == reference_bases_.end()) {
      continue;
    }
    const Node* found = nullptr;
    each_child(list->second, "REFERENCE-BASE"_tag, [&](const Node& candidate) {
      const bool matches = base != bases_.end() ? candidate.child_text("SHORT-LABEL"_tag) == base->second
                                                : candidate.child_text("IS-DEFAULT"_tag) == "true";
      const std::string_view package = candidate.child_text("PACKAGE-REF"_tag);
      if (matches && found == nullptr && package.starts_with('/')) {
        found = find(find(&root_, package.substr(1)), path);
      }
    });
    if (found != nullptr) {
      return found;
    }
  }
  // Relative to one of the elements around it, which no schema knows.
  for (const Node* node = reference.parent; node != nullptr; node = node->parent) {
    if (!node->name.empty() || node == &root_) {
      if (const Node* const found = find(node, path); found != nullptr) {
        problems_.warning(reference.place(), "\"" + std::string{path} + "\" is no path from the top; " +
                                                 Tree::path(found) + " was taken");
        return found;
      }
    }
  }
  if (!loose_known_) {
    loose_known_ = true;
    for (const auto& [key, node] : names_) {
      loose_[key.name].push_back(node);
    }
  }
  const std::size_t slash = path.rfind('/');
  const auto candidates = loose_.find(slash == std::string_view::npos ? path : path.substr(slash + 1));
  if (candidates != loose_.end() && candidates->second.size() == 1) {
    const Node* const found = candidates->second.front();
    problems_.warning(reference.place(), "\"" + std::string{path} + "\" is no path from the top; " +
                                             Tree::path(found) + ", the only one of that name, was taken");
    return found;
  }
  return nullptr;
}

const Node* Tree::resolve(const Node& reference) const {
  const std::string_view path = reference.text;
  if (path.empty()) {
    return nullptr;
  }
  return path.front() == '/' ? find(&root_, path.substr(1)) : guess(reference);
}

const Node* Tree::follow(const Node* node, Tag reference) const {
  const Node* const found = node == nullptr ? nullptr : node->child(reference);
  return found == nullptr ? nullptr : resolve(*found);
}

}  // namespace trestle::describe::arxml
